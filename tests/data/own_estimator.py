"""An estimator of a user's own: the last attitude read, the gyro's readings smoothed."""

import torquer


@torquer.estimator(
    parameters={"share": 0.5}, memory={"omega": (0.0, 0.0, 0.0)}, log={"omega": "rad/s"}
)
def smoothed(inputs, parameters, memory):
    """The rate goes a share of the way to each reading."""
    share, read, omega = parameters.share, inputs.omega_body_rad_s, memory.omega
    omega[0] += share * (read[0] - omega[0])
    omega[1] += share * (read[1] - omega[1])
    omega[2] += share * (read[2] - omega[2])
    q, found = inputs.q_body_to_inertial, (omega[0], omega[1], omega[2])
    return torquer.Estimate(inputs.t_s, q, found, (0.0, 0.0, 0.0), 0.0, 0.0)
