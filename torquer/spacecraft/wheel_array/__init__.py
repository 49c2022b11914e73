"""Arrays of reaction wheels: what momentum and torque they reach, and how to share a demand.

    from torquer.spacecraft.wheel_array import WheelArray, four_sided_pyramid, momentum_envelope

A layout is a `WheelArray` (axes and limits). The set of momentum vectors that it can hold is a
zonotope, an `Envelope`. Axes and vectors are in the body frame. An array that lost wheels is the
same array with limits of zero.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.spacecraft.wheel_array.allocation import allocate as allocate
    from torquer.spacecraft.wheel_array.angles import (
        GREATEST_VOLUME_DEG as GREATEST_VOLUME_DEG,
        balanced_four_sided as balanced_four_sided,
        balanced_regular as balanced_regular,
        least_four_sided as least_four_sided,
        least_regular as least_regular,
    )
    from torquer.spacecraft.wheel_array.demand import (
        Box as Box,
        Ellipsoid as Ellipsoid,
        Series as Series,
        greatest_momentum as greatest_momentum,
        greatest_norm as greatest_norm,
        greatest_share as greatest_share,
        share_for_generators as share_for_generators,
    )
    from torquer.spacecraft.wheel_array.envelope import (
        Envelope as Envelope,
        momentum_envelope as momentum_envelope,
        support as support,
        torque_envelope as torque_envelope,
    )
    from torquer.spacecraft.wheel_array.faces import volume as volume
    from torquer.spacecraft.wheel_array.failures import (
        FailureCase as FailureCase,
        LeastSquaresComparison as LeastSquaresComparison,
        failure_table as failure_table,
        least_squares_against_minimax as least_squares_against_minimax,
        least_squares_half_spaces as least_squares_half_spaces,
    )
    from torquer.spacecraft.wheel_array.layout import (
        WheelArray as WheelArray,
        four_sided_pyramid as four_sided_pyramid,
        icosahedral as icosahedral,
        orthogonal as orthogonal,
        orthogonal_and_skew as orthogonal_and_skew,
        regular_pyramid as regular_pyramid,
        total_momentum as total_momentum,
    )
    from torquer.spacecraft.wheel_array.presets import LAYOUTS as LAYOUTS, Wheels as Wheels
    from torquer.spacecraft.wheel_array.rates import (
        WorstCase as WorstCase,
        rate_about as rate_about,
        required_momenta as required_momenta,
        semi_axes as semi_axes,
        worst_case as worst_case,
    )
    from torquer.spacecraft.wheel_array.search import (
        Found as Found,
        find_layout as find_layout,
        free_axes as free_axes,
        greatest_volume as greatest_volume,
        greatest_worst_rate as greatest_worst_rate,
        least_norm as least_norm,
        least_peak as least_peak,
        least_squares_peak as least_squares_peak,
    )
    from torquer.spacecraft.wheel_array.steering import (
        Bias as Bias,
        Steering as Steering,
        lose as lose,
        make_steering as make_steering,
        steer as steer,
        steering_bias as steering_bias,
    )

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
