"""From the data sheet of a gyro, in terms of its Allan deviation, to the noise keys of a filter.

Allan variance over an averaging time T: N^2/T + (2 ln 2/pi) B^2 + K^2 T/3 with angle random walk
N, bias instability B, rate random walk K. IEEE Std 952.
"""

import math

#: Allan deviation of flicker noise over its bias instability.
FLICKER = math.sqrt(2.0 * math.log(2.0) / math.pi)


def filter_noise(
    *,
    angle_random_walk_deg_sqrt_h: float,
    bias_instability_deg_h: float = 0.0,
    rate_random_walk_deg_h_sqrt_h: float = 0.0,
    bridged_s: float = 2100.0,
) -> dict[str, float]:
    """Keys of a filter with a gyro: its angle random walk and rate random walk in seconds.

    A filter has no flicker noise: bias instability becomes the rate random walk of the same Allan
    deviation over `bridged_s`, the time for which the attitude is propagated by the gyro alone,
    such as an eclipse; the rate random walk of the data sheet is added. ValueError unless the
    numbers are finite, `angle_random_walk_deg_sqrt_h` and `bridged_s` above zero, the others not
    below it.
    """
    above = {
        "angle_random_walk_deg_sqrt_h": angle_random_walk_deg_sqrt_h,
        "bridged_s": bridged_s,
    }
    others = {
        "bias_instability_deg_h": bias_instability_deg_h,
        "rate_random_walk_deg_h_sqrt_h": rate_random_walk_deg_h_sqrt_h,
    }
    for key, value in (above | others).items():
        if not (math.isfinite(value) and (value > 0.0 or (key in others and value == 0.0))):
            must = "not be below zero" if key in others else "be above zero"
            raise ValueError(f"{key}: must {must}; received {value!r}")
    flicker = FLICKER * bias_instability_deg_h / 3600.0 * math.sqrt(3.0 / bridged_s)
    walk = math.hypot(flicker, rate_random_walk_deg_h_sqrt_h / 3600.0 / 60.0)
    return {
        "angle_random_walk_deg_sqrt_s": angle_random_walk_deg_sqrt_h / 60.0,
        "rate_random_walk_deg_s_sqrt_s": walk,
    }
