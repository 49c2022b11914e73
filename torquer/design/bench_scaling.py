"""What a B-dot test on a bench says of the time in orbit: MAG, section 5.2."""

from typing import NamedTuple


class Scaling(NamedTuple):
    """Time in orbit over that on the bench, by how the coils work.

    `saturated`: coils at their limit, J dw/dt ~ m B, so that the time goes with J/(m B): the text's
    own argument. `linear`: below the limit, J dw/dt ~ k B^2 w, so that it goes with J/(k B^2).
    """

    saturated: float
    linear: float


def scaling(
    inertia_ratio: float, field_ratio: float, dipole_ratio: float = 1.0, gain_ratio: float = 1.0
) -> Scaling:
    """Scaling of the time for ratios of orbit to bench: inertia, field, dipole limit, gain.

    Both hold for the same initial rate and the same directions of rotation and field. A bench field
    is constant: rotation about it is not braked, and the mean sine of the angle to the field is
    another than in orbit, where the field turns.
    """
    return Scaling(
        inertia_ratio / (dipole_ratio * field_ratio), inertia_ratio / (gain_ratio * field_ratio**2)
    )
