"""The goals of a run: limits that its motion must meet from some time to the end."""

from typing import Annotated

from pydantic import Field, model_validator

from torquer.base.spec import Spec, unit_vector

#: Orbital rates below which rotation usually counts as stopped by B-dot.
ORBITAL_RATES = 3.0
_Limit = Annotated[float, Field(gt=0.0)]
_Angle = Annotated[float, Field(gt=0.0, lt=180.0)]


class Mission(Spec):
    """Goals of the run, for the verdict in its report.

    Every limit must hold from some time to the end of the run. The verdict states that time, and
    when each limit was first met; where a motion that does not decay crosses a limit again and
    again, it says that the limit lies within the residual motion. Without this table the verdict
    uses a limit that is usual for the laws of the scenario, and says so.
    """

    rate_below_deg_s: _Limit | None = None
    """Limit on the absolute rate."""
    rate_orbital_below_deg_s: _Limit | None = None
    """Limit on the rate relative to the orbital frame."""
    attitude_error_below_deg: _Angle | None = None
    """Limit on the deviation from the attitude that built-in laws hold, of targets the one that
    these give at the time: with modes the laws of the present states. While these hold none, or
    two, there is no error, and the limit is not met.
    """
    commanded_error_below_deg: _Angle | None = None
    """Limit on the deviation from the attitude that a law with slews steers meanwhile: along a slew
    it turns with the satellite, while the attitude error is from the one at its end.
    """
    sun_angle_below_deg: _Angle | None = None
    """Limit on the angle between `axis` and the Sun."""
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)  # type: ignore[valid-type]
    """Axis in the body, of any length, for `sun_angle_below_deg`."""
    within_s: _Limit | None = None
    """Time by which the limits must hold; left out: the end of the run."""

    @model_validator(mode="after")
    def _has_a_limit(self):
        limits = ("rate_below_deg_s", "rate_orbital_below_deg_s", "attitude_error_below_deg",
                  "commanded_error_below_deg", "sun_angle_below_deg")  # fmt: skip
        if all(getattr(self, name) is None for name in limits):
            raise ValueError(f"mission: must have one of {', '.join(limits)}; received none")
        return self
