"""The averaged equations of a law in LaTeX, derived by sympy from the law as it flies."""

from typing import Any

import sympy

from torquer.computer.laws import LAWS
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.symbolic import (
    as_latex,
    averaged_equations,
    axial,
    momentum,
    theta,
    transverse,
)

_UP, _INERTIA = {"target": (0.0, 0.0, 1.0)}, {"inertia_kg_m2": (1.0, 1.0, 1.0)}
#: Kind, key of the gain and further keys of each law, with a target along the cone axis; the
#: values are replaced by symbols.
_KINDS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "bdot": ("bdot_rate", "gain_a_m2_s_per_t", {}),
    "nutation_damping": ("nutation_damping_rate", "gain_a_m2_s_per_t", {}),
    "spin_up": ("spin_up", "gain_a_m2_per_t", {}),
    "reorientation": (
        "reorientation", "gain_a_m2_per_n_m_s_t", {**_UP, **_INERTIA, "momentum_n_m_s": 1.0}
    ),
    "preliminary_1": ("preliminary_1", "gain_a_m2_per_t", _UP),
    "preliminary_2": ("preliminary_2", "gain_a_m2_per_t", {**_UP, **_INERTIA}),
    "sdot": ("sdot_rate", "gain_a_m2_s", {}),
}  # fmt: skip


def law_latex(law: str) -> str:
    """The averaged equations of a law that has closed ones; needs sympy."""
    kind, gain, others = _KINDS[law]
    made = LAWS[kind](**{gain: 1.0}, **others).law()
    symbols: dict[str, Any] = {"gain": sympy.Symbol("k", positive=True)}
    if "inertia" in made.values():
        moments = (transverse, transverse, axial)
        symbols["inertia"] = (*moments, 0.0, 0.0, 0.0)
    if "momentum" in made.values():
        symbols["momentum"] = momentum
    found: Any = averaged_equations(made, symbols)
    if law == "reorientation":  # a spin about the axis
        found = Slow(*(sympy.factor(x.subs(theta, 0)) for x in found))
    return as_latex(found)
