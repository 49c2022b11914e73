"""When a run ends before its time: a condition on the motion, looked at at the records."""

from typing import Literal

from pydantic import Field, model_validator

from torquer.base.spec import Spec


class EndWhen(Spec):
    """The run ends at the first record after the start at which this has held for a time.

    What has been computed then is what the whole run would have had until then, to the bit.
    """

    signal: Literal["rate_deg_s", "rate_fastest_axis_deg_s", "momentum_n_m_s"]
    """'rate_deg_s' (absolute rate), 'rate_fastest_axis_deg_s' (the greatest about an axis of
    the body, without a sign), or 'momentum_n_m_s' (of body and wheels), all true values.
    """
    of_start: bool = False
    """Whether the signal is taken as a fraction of its value at the start."""
    below: float | None = Field(default=None, gt=0.0)
    """The signal must be below this value. Either it or `above` is given."""
    above: float | None = Field(default=None, ge=0.0)
    """The signal must be above this value."""
    for_s: float = Field(default=0.0, ge=0.0)
    """How long it must hold, at all records."""

    @model_validator(mode="after")
    def _one_is_given(self):
        if (self.below is None) == (self.above is None):
            received = "none" if self.below is None else "both"
            raise ValueError(f"must have below or above; received {received}")
        return self

    @property
    def in_words(self) -> str:
        """The condition."""
        side, limit = ("below", self.below) if self.below is not None else ("above", self.above)
        fraction = " of its start" if self.of_start else ""
        while_ = f" for {self.for_s:g} s" if self.for_s else ""
        return f"{self.signal} {side} {limit:g}{fraction}{while_}"
