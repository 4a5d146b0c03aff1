c     @TITLE@
c     Resistance for Abaqus/Explicit, written by penetrode @VERSION@.
c
c     F = p + s x + r V + q V**2 in each stage, as the pressure F/area
c     on a flat face. x is coordinate 2 of the face, 0 at impact, and V
c     its velocity 2; kg, m, s. The coefficients are those of the impact
c     velocity @VELOCITY@ m/s, on which
c     the crater constant depends. At rest the pressure ends. @EXIT@
c     Newer releases hand over vua(nblock,ndim,3), which begins with
c     velocity(nblock,ndim): this text fits both.
      subroutine vdload (
c     read only
     1 nblock, ndim, stepTime, totalTime,
     2 amplitude, curCoords, velocity, dirCos, jltyp, sname,
c     defined here
     3 value )
      include 'vaba_param.inc'
      dimension curCoords(nblock,ndim), velocity(nblock,ndim),
     1 dirCos(nblock,ndim,ndim), value(nblock)
      character*80 sname
      parameter (nstage = @STAGES@)
      dimension fp(nstage), fs(nstage), fr(nstage), fq(nstage)
      dimension send(nstage)
@DATA@
      do 100 km = 1, nblock
        x = curCoords(km,2)
        v = velocity(km,2)
        j = 1
   50   if (j .lt. nstage) then
          if (send(j) .le. x) then
            j = j + 1
            goto 50
          endif
        endif
        value(km) = 0
        if (v .gt. 0) then
          value(km) = (fp(j) + fs(j)*x + (fr(j) + fq(j)*v)*v)/area
        endif
  100 continue
      return
      end
