"""Mean products of the field along an orbit, by quadrature: the definition of the closed forms."""

import math

from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import add
from torquer.theory.slow.orbit_field import field_at


@kernel
def mean_products(field, nodes_u, nodes_day):
    """Means <b_i b_j> [T^2] over u and day by the trapezoid rule: (xx, yy, zz, xy, xz, yz).

    The products are trigonometric polynomials of degree 4 in u and 2 in the day angle: from 5
    and 3 nodes on the rule is exact. Source: MAG (2.1.7), FIELD (2.4).
    """
    squares = mixed = (0.0, 0.0, 0.0)
    for j in range(nodes_day):
        for i in range(nodes_u):
            u, day = 2.0 * math.pi * i / nodes_u, 2.0 * math.pi * j / nodes_day
            x, y, z = field_at(field, u, day)
            squares = add(squares, (x * x, y * y, z * z))
            mixed = add(mixed, (x * y, x * z, y * z))
    one = 1.0 / (nodes_u * nodes_day)
    return (
        one * squares[0],
        one * squares[1],
        one * squares[2],
        one * mixed[0],
        one * mixed[1],
        one * mixed[2],
    )
