"""Specs: frozen, validated descriptions of things. Their keys carry units; kernels get SI.

A spec is checked once, on creation; `pack()`, where a spec has it, gives the tuples or the
`float64` array that kernels take.
"""

from pydantic import BaseModel, ConfigDict


class Spec(BaseModel):
    """Base of all specs: frozen, unknown keys are errors, numbers must be finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


#: Three numbers.
Vector = tuple[float, float, float]
