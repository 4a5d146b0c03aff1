! A solver of your own, asked by penetrode: it reads one question a line and answers one a line, both in JSON.
!
!     gfortran -O2 -std=f2008 -o peer peer.f90
!     penetrode diagnose ./peer                         what is wrong?
!     penetrode verify --only peer/user --peer ./peer   does it agree?
!
! It runs as it stands. YOUR INTEGRATOR GOES INTO `solve_stage`; all below it is the protocol and may stay as it is.
! SI units throughout. In each stage, with x counted from the impact face,
!
!     dx/dt = V,    M dV/dt = -(p + s x + r V + q V^2),    until V = 0, the end of the stage or the exit depth.

module peer
  use, intrinsic :: iso_fortran_env, only: real64, int64, input_unit, output_unit
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none

  ! Who you are. A solver with steps of one size adds "fixed_step": true; each question then has the step to use, "dt_s",
  ! and rtol and atol mean nothing. One that computes its forces itself adds "reads": "scene"; each question then has the
  ! physical scene, "scene": mass_kg, diameter_m, strength_pa ...
  character(*), parameter :: hello = '{"name": "my solver", "version": "1.0", "method": "Dormand-Prince 5(4)"}'

  integer, parameter :: dp = real64, steps_max = 1000000, until_rest = 1, until_limit = 2
  real(dp), parameter :: infinite = huge(1.0_dp)

  ! The method of Dormand and Prince: a column for each evaluation after the first, the last at the new point, and what
  ! the new point has beyond that of order 4.
  real(dp), parameter :: columns(6, 6) = reshape([ &
    1/5.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, &
    3/40.0_dp, 9/40.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, &
    44/45.0_dp, -56/15.0_dp, 32/9.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, &
    19372/6561.0_dp, -25360/2187.0_dp, 64448/6561.0_dp, -212/729.0_dp, 0.0_dp, 0.0_dp, &
    9017/3168.0_dp, -355/33.0_dp, 46732/5247.0_dp, 49/176.0_dp, -5103/18656.0_dp, 0.0_dp, &
    35/384.0_dp, 0.0_dp, 500/1113.0_dp, 125/192.0_dp, -2187/6784.0_dp, 11/84.0_dp], [6, 6])
  real(dp), parameter :: beyond(7) = [71/57600.0_dp, 0.0_dp, -71/16695.0_dp, 71/1920.0_dp, -17253/339200.0_dp, &
    22/525.0_dp, -1/40.0_dp]

  ! Force p + s x + r V + q V^2 on the mass, and the tolerances that the question asks for.
  type :: stage_type
    real(dp) :: mass, p, s, r, q, rtol, atol(2)
  end type

contains

  ! Flies through one stage from time t, depth x and velocity v > 0 until x = limit (may be `infinite`) or V = 0, and
  ! moves t, x, v there: x is `limit` itself where that was reached, and v is 0 where the projectile came to rest.
  subroutine solve_stage(stage, limit, t, x, v, is_solved)
    type(stage_type), intent(in) :: stage
    real(dp), intent(in) :: limit
    real(dp), intent(inout) :: t, x, v
    logical, intent(out) :: is_solved
    real(dp) :: a, h, x1, v1, a1, error, factor
    integer :: step_count

    is_solved = .true.
    a = acceleration(stage, x, v)
    h = (x + stage%atol(1) / stage%rtol) / v
    if (abs(a) * h > v) h = v / abs(a)
    h = 0.01_dp * h
    do step_count = 1, steps_max
      call step(stage, x, v, a, h, x1, v1, a1, error)
      factor = 0.2_dp
      if (error < 1000) factor = min(5.0_dp, 0.9_dp * max(error, 1e-9_dp)**(-0.2_dp))
      if (.not. error <= 1) then
        h = h * factor
        cycle
      end if
      ! A step over the turning point may begin and end before the limit and pass it twice: the turning point first.
      if (v1 <= 0) then
        call shorten(stage, x, v, a, h, x1, v1, until_rest, limit)
        if (x1 < limit) then
          t = t + h; x = x1; v = 0
          return
        end if
      end if
      if (x1 >= limit) then
        call shorten(stage, x, v, a, h, x1, v1, until_limit, limit)
        t = t + h; x = limit; v = max(v1, 0.0_dp)
        return
      end if
      t = t + h; x = x1; v = v1; a = a1; h = h * factor
    end do
    is_solved = .false.
  end subroutine

  real(dp) pure function acceleration(stage, x, v)
    type(stage_type), intent(in) :: stage
    real(dp), intent(in) :: x, v
    acceleration = -(stage%p + stage%s * x + (stage%r + stage%q * v) * v) / stage%mass
  end function

  ! From x, v, a on by h: depth, velocity and acceleration there, and the estimated error over the tolerance.
  subroutine step(stage, x, v, a, h, x1, v1, a1, error)
    type(stage_type), intent(in) :: stage
    real(dp), intent(in) :: x, v, a, h
    real(dp), intent(out) :: x1, v1, a1, error
    real(dp) :: slope_x(7), slope_v(7)
    integer :: i

    slope_x(1) = v; slope_v(1) = a
    do i = 1, 6
      x1 = x + h * dot_product(columns(:i, i), slope_x(:i))
      v1 = v + h * dot_product(columns(:i, i), slope_v(:i))
      slope_x(i + 1) = v1; slope_v(i + 1) = acceleration(stage, x1, v1)
    end do
    a1 = slope_v(7)
    error = max(abs(h * dot_product(beyond, slope_x)) / (stage%atol(1) + stage%rtol * abs(x1)), &
                abs(h * dot_product(beyond, slope_v)) / (stage%atol(2) + stage%rtol * abs(v1)))
    if (.not. ieee_is_finite(x1 + v1 + a1)) error = infinite
  end subroutine

  ! Shortens the step h to the one at whose end V = 0, or x = limit: Newton within a bracket.
  subroutine shorten(stage, x, v, a, h, x1, v1, until, limit)
    type(stage_type), intent(in) :: stage
    real(dp), intent(in) :: x, v, a, limit
    real(dp), intent(inout) :: h
    real(dp), intent(out) :: x1, v1
    integer, intent(in) :: until
    real(dp) :: low, high, a1, error, gap, rate, next
    integer :: count

    low = 0; high = h
    do count = 1, 100
      call step(stage, x, v, a, h, x1, v1, a1, error)
      if (until == until_rest) then
        gap = v1; rate = a1
      else
        gap = limit - x1; rate = -v1
      end if
      if (gap > 0) then
        low = h
      else
        high = h
      end if
      next = -1
      if (rate /= 0) next = h - gap / rate
      if (abs(next - h) <= 1e-16_dp * h .or. high - low <= 1e-16_dp * h) exit
      if (.not. (low < next .and. next < high)) next = (low + high) / 2
      h = next
    end do
  end subroutine

  ! One flight: from stage to stage until rest or exit, every event on the way listed. `error` says why there is none.
  subroutine solve(question, answer, error)
    character(*), intent(in) :: question
    character(:), allocatable, intent(out) :: answer, error
    character(:), allocatable :: events, outcome, text
    type(stage_type) :: stage
    real(dp) :: t, x, v, exit_depth, stage_end, limit
    character(12) :: number
    integer :: index_of_stage, place, length, status
    logical :: is_solved

    error = ''; events = ''; outcome = 'stopped'; t = 0; x = 0
    v = value(question, 'velocity_m_s', error)
    exit_depth = value(question, 'exit_depth_m', error, infinite)
    stage%mass = value(question, 'mass_kg', error)
    stage%rtol = value(question, 'rtol', error)
    text = question(behind(question, 'atol'):)
    text = text(index(text, '[') + 1:)
    read (text(:index(text, ']') - 1), *, iostat=status) stage%atol
    if (status /= 0) error = 'atol is not two numbers'
    text = question(behind(question, 'stages'):)
    place = index(text, '[') + 1
    do index_of_stage = 0, len(question)
      length = index(text(place:), '}')
      stage%p = value(text(place:place + length - 1), 'static_force_n', error)
      stage%s = value(text(place:place + length - 1), 'stiffness_n_m', error)
      stage%r = value(text(place:place + length - 1), 'viscosity_kg_s', error)
      stage%q = value(text(place:place + length - 1), 'drag_kg_m', error)
      stage_end = value(text(place:place + length - 1), 'end_m', error, infinite)
      place = place + length
      limit = min(stage_end, exit_depth)
      if (error == '' .and. x < limit .and. v > 0) then
        call solve_stage(stage, limit, t, x, v, is_solved)
        if (.not. is_solved) error = 'too many steps in a stage'
      end if
      if (.not. ieee_is_finite(t + x + v)) error = 'the answer is not finite'
      if (error /= '') return
      if (x < limit) exit
      if (stage_end <= exit_depth) then
        write (number, '(i0)') index_of_stage
        call happened('"stage-end", "stage": ' // trim(number))
      end if
      if (exit_depth <= stage_end) then
        call happened('"exit"')
        outcome = 'perforated'
        exit
      end if
    end do
    if (v <= 0) call happened('"rest"')
    answer = '"outcome": "' // outcome // '", ' // numbers() // ', "events": [' // events // ']'

  contains

    subroutine happened(event)
      character(*), intent(in) :: event
      if (events /= '') events = events // ', '
      events = events // '{"event": ' // event // ', ' // numbers() // '}'
    end subroutine

    function numbers() result(text)
      character(:), allocatable :: text
      text = '"time_s": ' // decimal(t) // ', "depth_m": ' // decimal(x) // ', "velocity_m_s": ' // decimal(v)
    end function
  end subroutine

  ! The place behind `"key":`. The text is searched as it stands: no key stands in it twice with two values.
  integer function behind(text, key)
    character(*), intent(in) :: text, key
    behind = index(text, '"' // key // '"')
    if (behind > 0) behind = behind + len(key) + 2 + index(text(behind + len(key) + 2:), ':')
  end function

  ! The number under `key`; `null` is `instead`, where that is given.
  real(dp) function value(text, key, error, instead)
    character(*), intent(in) :: text, key
    character(:), allocatable, intent(inout) :: error
    real(dp), intent(in), optional :: instead
    integer :: first, length, status

    first = behind(text, key)
    value = 0; status = 1
    if (first > 0) then
      length = scan(text(first:) // ',', ',}]') - 1
      if (present(instead) .and. adjustl(text(first:first + length - 1)) == 'null') then
        value = instead; status = 0
      else
        read (text(first:first + length - 1), *, iostat=status) value
      end if
    end if
    if (status /= 0) error = key // ' is not a number'
  end function

  function decimal(number) result(text)
    real(dp), intent(in) :: number
    character(:), allocatable :: text
    character(30) :: digits
    write (digits, '(es25.16e3)') number
    text = trim(adjustl(digits))
  end function

  ! The next line of standard input, however long; not allocated behind the last.
  subroutine read_line(line)
    character(:), allocatable, intent(out) :: line
    character(4096) :: part
    integer :: length, status

    line = ''
    do
      read (input_unit, '(a)', advance='no', size=length, iostat=status) part
      if (status > 0 .or. is_iostat_end(status)) then
        deallocate (line)
        return
      end if
      line = line // part(:length)
      if (is_iostat_eor(status)) return
    end do
  end subroutine
end module

program main
  use peer
  implicit none
  character(:), allocatable :: line, answer, error, id
  integer(int64) :: start, finish, rate
  integer :: count, repeats
  character(:), allocatable :: unread

  do
    call read_line(line)
    if (.not. allocated(line)) exit
    if (index(line, '"hello"') > 0) then
      answer = hello
    else
      unread = ''
      id = line(behind(line, 'id'):)
      id = id(:scan(id, ',}') - 1)
      repeats = max(1, nint(value(line, 'repeats', unread)))  ! more than one only where `bench` measures the time
      call system_clock(start, rate)
      do count = 1, repeats
        call solve(line, answer, error)
      end do
      call system_clock(finish)
      if (error == '') then
        answer = answer // ', "wall_ns": ' // decimal(1e9_dp * real(finish - start, dp) / (real(rate, dp) * repeats))
      else
        answer = '"error": "' // error // '"'  ! the next question may be solved
      end if
      answer = '{"id": ' // id // ', ' // answer // '}'
    end if
    write (output_unit, '(a)') answer
    flush (output_unit)
  end do
end program
