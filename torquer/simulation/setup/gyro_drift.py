"""The drift that a simulated gyro has had: the record of a run does not keep it."""

from torquer.base import noise
from torquer.compile.engine import kernel
from torquer.spacecraft.sensors.gyro import DRIFT_STREAM, walked_bias


@kernel
def fill_drift(gyro, seed, t_s, out):
    """Accumulated drift [rad/s] of a gyro at its readings (n, 3), as the simulation has it.

    `t_s` (n,): when it has been read.
    """
    drift = (0.0, 0.0, 0.0)
    for k in range(out.shape[0]):
        drawn = noise.draw(gyro.drift_rad_s_sqrt_s, seed, DRIFT_STREAM, k)
        drift = walked_bias(gyro, drift, t_s[k] - t_s[max(k - 1, 0)], drawn)
        out[k, 0], out[k, 1], out[k, 2] = drift
