"""Scale factors and misalignment of three-axis sensors as states of a filter.

A sensor reads v' = diag(1 + k) R(d)^T v + bias: k the relative errors of its scale factors, d the
rotation vector of its misalignment, both small (`spacecraft.sensors.sensing.mounting_matrix`). To
first order v' = v + diag(v) k + v x d + bias.
"""

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import read_state, skew
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate


@inlined
def by_scale(v):
    """What relative errors of the scale factors do to a reading of v: diag(v)."""
    return ((v[0], 0.0, 0.0), (0.0, v[1], 0.0), (0.0, 0.0, v[2]))


@inlined
def by_misalignment(v):
    """What a misalignment does to a reading of v: the matrix of v x."""
    return skew(v)


@inlined
def without_mounting(states, scale_at, misalignment_at, v):
    """A reading, less its bias, without the scale errors and the misalignment as they are known.

    `scale_at`, `misalignment_at`: first rows of these states in the covariance, 0 for none.
    """
    if scale_at > 0:
        k = read_state(states, scale_at)
        v = (v[0] / (1.0 + k[0]), v[1] / (1.0 + k[1]), v[2] / (1.0 + k[2]))
    if misalignment_at > 0:
        v = rotate(from_rotation_vector(read_state(states, misalignment_at)), v)
    return v
