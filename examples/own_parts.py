"""Parts of a satellite and its surroundings that torquer does not have: see own_parts.toml."""

import math

import numpy as np

import torquer


def raised(t_s, start, thrust_n=0.02, mass_kg=12.0):
    """A circular orbit that electric propulsion raises: positions [m] and velocities [m/s]."""
    mu = 3.986004418e14
    a = 6.9e6 + 2.0 * thrust_n / mass_kg * t_s * np.sqrt(6.9e6**3 / mu)
    rate, u = np.sqrt(mu / a**3), np.sqrt(mu / 6.9e6**3) * t_s
    c, s, tilt = np.cos(u), np.sin(u), np.radians(97.5)
    r = np.stack([c, s * np.cos(tilt), s * np.sin(tilt)], axis=1)
    v = np.stack([-s, c * np.cos(tilt), c * np.sin(tilt)], axis=1)
    return a[:, None] * r, (a * rate)[:, None] * v


def stormy(r_ecef_m, years, ring_nt=-150.0):
    """A dipole, and the ring current of a magnetic storm [T]."""
    distance = np.linalg.norm(r_ecef_m, axis=1)[:, None]
    up = r_ecef_m / distance
    moment = np.array([0.4e15, -1.3e15, -7.7e15])
    dipole = (3.0 * up * (up @ moment)[:, None] - moment) / distance**3
    return dipole - 1e-9 * ring_nt * np.array([0.0, 0.0, -1.0])


def bulge(r_ecef_m, years, density=3e-13):
    """An exponential atmosphere [kg/m^3]."""
    height_m = np.linalg.norm(r_ecef_m, axis=1) - 6.378e6
    return density * np.exp(-(height_m - 520e3) / 65e3)


def thruster(here, force_n=0.02, arm_m=1e-4, until_s=3000.0):
    """A thruster that misses the centre of mass; it fades within some ten seconds [N m]."""
    burning = 0.5 - 0.5 * math.tanh((here.t_s - until_s) / 10.0)
    return (0.0, burning * force_n * arm_m, 0.0)


def heat_flux(here, albedo_w=0.02, gain=1.0):
    """Three thermopiles along the body axes: sunlight, and noise [W]."""
    light, (x, y, z), noise = here.sunlit_fraction, here.sun_body, here.noise
    return (
        gain * light * max(x, 0.0) + albedo_w + noise[0],
        gain * light * max(y, 0.0) + albedo_w + noise[1],
        gain * light * max(z, 0.0) + albedo_w + noise[2],
    )


@torquer.estimator(
    parameters={"share": 0.2}, memory={"omega": (0.0, 0.0, 0.0)}, log={"omega": "rad/s"}
)
def calm(inputs, parameters, memory):
    """The gyro's readings, smoothed; the attitude as it is read."""
    share, read, omega = parameters.share, inputs.omega_body_rad_s, memory.omega
    omega[0] += share * (read[0] - omega[0])
    omega[1] += share * (read[1] - omega[1])
    omega[2] += share * (read[2] - omega[2])
    q, found = inputs.q_body_to_inertial, (omega[0], omega[1], omega[2])
    return torquer.Estimate(inputs.t_s, q, found, (0.0, 0.0, 0.0), 0.0, 0.0)
