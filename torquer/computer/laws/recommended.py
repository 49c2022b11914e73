"""Schemes for a satellite that is to spin about an axis which points to a target.

They are data, the `law` of a scenario: to be looked at, changed and written to a file.
"""

import math

import numpy as np

from torquer.base import validate
from torquer.environment.field.averaged import cone_angle

#: When nutation counts as damped: conditions of a stage.
DAMPED = {"nutation_below_deg": 5.0, "for_s": 60.0}


def is_low(inclination_deg: float) -> bool:
    """Whether an inclination counts as low: below 45.58 deg, or as near to 180.

    MAG has words only. The limit here is where the averaged field has no direction of its own,
    sin^2 Theta = 2/3: below it the second preliminary law brings a momentum less than 90 deg off
    to the cone's axis faster than the first one does, above it slower (3p - 1 in its averaged
    equations).
    """
    if not 0.0 <= inclination_deg <= 180.0:
        raise ValueError(f"inclination_deg: must lie within 0 to 180; received {inclination_deg}")
    return math.sin(cone_angle(math.radians(inclination_deg))) ** 2 < 2.0 / 3.0


def standard_scheme(
    *,
    target,
    inertia_kg_m2,
    spin_deg_s: float,
    nutation_damping: dict,
    spin_up: dict,
    reorientation: dict,
    during_spin_up: dict | None = None,
    axis=(0.0, 0.0, 1.0),
    damped: dict = DAMPED,
) -> dict:
    """Nutation damping, spin-up, precise reorientation, as data.

    `nutation_damping`, `spin_up`, `reorientation`: keys of the three laws, a gain or a relay at
    least; `kind` in the first may name another of its laws. `during_spin_up`: keys of nutation
    damping that goes on then. `damped`: conditions that end the damping. The spin-up ends at
    `spin_deg_s` about the axis, and the momentum to reach is that of this spin.

        >>> scheme = torquer.standard_scheme(
        ...     target=(0.0, 0.0, 1.0), inertia_kg_m2=(0.1, 0.1, 0.15), spin_deg_s=3.0,
        ...     nutation_damping={"gain_a_m2_s_per_t": 1e5}, spin_up={"gain_a_m2_per_t": 1e4},
        ...     reorientation={"gain_a_m2_per_t": 1e4},
        ... )
        >>> len(scheme["stages"])
        3
    """
    tensor = validate.inertia_tensor("inertia_kg_m2", inertia_kg_m2)
    along = np.asarray(axis, float) / np.linalg.norm(axis)
    momentum = float(np.linalg.norm(tensor @ along)) * math.radians(spin_deg_s)
    spinning_up = [{"kind": "spin_up", **spin_up}]
    if during_spin_up is not None:
        spinning_up.append(_damping(during_spin_up))
    precise = {"kind": "reorientation", "momentum_n_m_s": momentum, **reorientation}
    return {
        "kind": "scheme",
        "axis": list(axis),
        "target": target,
        "inertia_kg_m2": inertia_kg_m2,
        "stages": [
            {"laws": [_damping(nutation_damping)], "until": dict(damped)},
            {"laws": spinning_up, "until": {"spin_above_deg_s": spin_deg_s}},
            {"laws": [precise]},
        ],
    }


def recommended_scheme(
    inclination_deg: float,
    *,
    preliminary: dict,
    preliminary_at_most_s: float | None = None,
    **standard,
) -> dict:
    """The scheme for an orbit's inclination, as data: that of MAG's table 3.5.1.

    Low (see `is_low`): second preliminary law with nutation damping, spin-up, reorientation. Else:
    first preliminary law with nutation damping, nutation damping, spin-up, reorientation.
    `preliminary`: keys of either preliminary law, a gain or a relay; it must be weaker than the
    damping, which it works against. `preliminary_at_most_s`: limit of its stage, whose other end
    is that of the damping. The rest as for `standard_scheme`.

        >>> scheme = torquer.recommended_scheme(
        ...     60.0, preliminary={"gain_a_m2_per_t": 1e3}, target=(0.0, 0.0, 1.0),
        ...     inertia_kg_m2=(0.1, 0.1, 0.15), spin_deg_s=3.0,
        ...     nutation_damping={"gain_a_m2_s_per_t": 1e5}, spin_up={"gain_a_m2_per_t": 1e4},
        ...     reorientation={"gain_a_m2_per_t": 1e4},
        ... )
        >>> len(scheme["stages"])
        4
    """
    found = standard_scheme(**standard)
    damping, *rest = found["stages"]
    low = is_low(inclination_deg)
    law = {"kind": "preliminary_2" if low else "preliminary_1", **preliminary}
    until = dict(damping["until"])
    if preliminary_at_most_s is not None:
        until["at_most_s"] = preliminary_at_most_s
    joint = {"laws": [*damping["laws"], law], "until": until}
    return {**found, "stages": [joint, *([] if low else [damping]), *rest]}


def _damping(keys: dict) -> dict:
    return {"kind": "nutation_damping", **keys}
