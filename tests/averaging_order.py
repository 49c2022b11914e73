"""The order of the error of averaging in the small parameter."""

import numpy as np

from torquer.theory.slow.comparison import compare


def fitted_order(law, spinner, start, fast, slow_time, scales, **keys):
    """(order, errors): the law's gain is multiplied by each scale, over u = 0..slow_time/scale."""
    scales, gain = np.array(scales), law.values()["gain"]
    errors = [
        compare(
            law.with_parameters(gain=gain * s), spinner, start, fast, slow_time / s, **keys
        ).error
        for s in scales.tolist()
    ]
    return float(np.polyfit(np.log(scales), np.log(errors), 1)[0]), np.array(errors)
