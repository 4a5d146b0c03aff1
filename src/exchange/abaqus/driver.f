c     @TITLE@
c     Calls vdload.f as Abaqus/Explicit does, with the velocity of the
c     half step, and advances one rigid body by central differences:
c
c       gfortran -O0 -ffixed-form -I double vdload.f driver.f -o drive
c       ./drive @DT@
c
c     With -I single in single precision. Prints how it ended, steps,
c     time, depth and velocity of the first step end at which the
c     velocity is no longer above zero, or the depth not below
c     @WHERE@.
      program drive
      include 'vaba_param.inc'
      dimension cur(1,2), vel(1,2), dir(1,2,2), value(1)
      character*80 sname, word
      call get_command_argument(1, word)
      read (word,*) dt
      xexit = @XEXIT@
      area = @AREA@
      rmass = @MASS@
      v = @V0@
      x = 0
      half = dt/2
      dir = 0
      sname = 'PROJECTILE'
      cur(1,1) = 0
      vel(1,1) = 0
      amplitude = 1
      jltyp = 0
      u = v
      istep = 0
   10 cur(1,2) = x
      vel(1,2) = u
      time = istep*dt
      call vdload(1, 2, time, time, amplitude, cur, vel, dir, jltyp,
     1 sname, value)
      d = value(1)*area/rmass
      if (istep .eq. 0) then
        u = v + half*d
      else
        v = u - half*d
        if (x .ge. xexit) goto 20
        if (v .le. 0) goto 30
      endif
      xlast = x
      u = u - dt*d
      x = x + dt*u
      istep = istep + 1
      if (istep .lt. 100000000) goto 10
      write (*,'(a)') 'neither-in-1e8-steps'
      stop
   20 write (*,40) 'perforated', istep, istep*dt, x, v
      stop
   30 write (*,40) 'stopped', istep, istep*dt, max(x, xlast), 0.0
   40 format (a, 1x, i9, 3(1x, es25.16e3))
      end
