"""What `law_motion` and `law_gains` are asked; the options of `torquer theory` are the same.

The class stands apart from the functions, so that the help of the command loads no compiler.
"""

from typing import Annotated

from torquer.base.limits import Three, positive, request, within

_HALF_TURN = within(0.0, 180.0, "deg")


@request
class LawRequest:
    """What `law_motion` and `law_gains` are asked: satellite and orbit, where no scenario has them.

    LawRequest(inclination_deg=51.6, altitude_km=550.0, inertia=(1.0, 1.2, 1.5), gain=1e6)
    """

    inclination_deg: Annotated[float | None, _HALF_TURN] = None
    """Inclination of the circular orbit."""
    altitude_km: Annotated[float | None, positive()] = None
    """Altitude of the circular orbit."""
    strength_nt: Annotated[float | None, positive("strength_nt")] = None
    """Averaged field B0 [nT] [that of the altitude]."""
    inertia: Three | None = None
    """Principal moments [kg m^2], spin axis last."""
    gain: Annotated[float | None, positive("gain_a_m2_per_t")] = None
    """Gain of the law, in its own unit."""
    rate_deg_s: Three | None = None
    """Initial rate in body axes [5 5 5; reorientation 0 0 5]."""
    rho_deg: Annotated[float | None, _HALF_TURN] = None
    """Initial angle of the momentum from the field's cone axis [any]."""
    sun_deg: Annotated[float | None, _HALF_TURN] = None
    """Angle of the Sun from the field's cone axis, for sdot."""
    sample_s: Annotated[float | None, positive()] = None
    """Sampling and hold interval, for bdot and nutation_damping."""
    lag_s: float | None = None
    """Time constant of the coils, where they are sampled [0]."""
    to: float | None = None
    """Target fraction of the initial value [%] [10; spin_up 200]."""
    revolutions: Annotated[float | None, positive("revolutions")] = None
    """Time span of the plots; for gains the time allowed."""


#: What goes with a scenario, too.
ALWAYS = ("to", "revolutions")
