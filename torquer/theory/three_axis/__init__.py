"""Linear theory of an attitude that a magnetic law holds: averaged, exact, sampled, designed.

`averaged` in closed form; `hold` takes the linear equations from the law's own kernel; `floquet`
their exact stability, `sampled` the same with the computer's cycle.
"""
