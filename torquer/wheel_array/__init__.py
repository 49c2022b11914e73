# ruff: noqa: F401 (the imports under TYPE_CHECKING are the list of public names)
"""Arrays of reaction wheels: what momentum and torque they reach, and how to share a demand.

    from torquer.wheel_array import WheelArray, four_sided_pyramid, momentum_envelope

A layout is a `WheelArray` (axes and limits). The set of momentum vectors that it can hold is a
zonotope, an `Envelope`. Axes and vectors are in the body frame. An array that lost wheels is the
same array with limits of zero.
"""

from typing import TYPE_CHECKING

from torquer.lazy import lazily

if TYPE_CHECKING:
    from torquer.wheel_array.allocation import allocate
    from torquer.wheel_array.angles import (
        GREATEST_VOLUME_DEG,
        balanced_four_sided,
        balanced_regular,
        least_four_sided,
        least_regular,
    )
    from torquer.wheel_array.demand import (
        Box,
        Ellipsoid,
        Series,
        greatest_momentum,
        greatest_norm,
        greatest_share,
        greatest_share_of,
    )
    from torquer.wheel_array.envelope import (
        Envelope,
        momentum_envelope,
        support,
        torque_envelope,
        volume,
    )
    from torquer.wheel_array.failures import (
        Comparison,
        FailureCase,
        failure_table,
        least_squares_against_minimax,
        least_squares_half_spaces,
    )
    from torquer.wheel_array.layout import (
        WheelArray,
        four_sided_pyramid,
        icosahedral,
        orthogonal,
        orthogonal_and_skew,
        regular_pyramid,
        total_momentum,
    )
    from torquer.wheel_array.presets import LAYOUTS, Wheels
    from torquer.wheel_array.rates import WorstCase, rate_about, required, semi_axes, worst_case
    from torquer.wheel_array.search import (
        Found,
        find_layout,
        free_axes,
        greatest_volume,
        greatest_worst_rate,
        least_norm,
        least_peak,
        least_squares_peak,
    )
    from torquer.wheel_array.steering import Bias, Steering, bias_of, lose, steer, steering_of

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
