"""Tip-offs of satellites that are not as believed: telemetry of simulated flights, the truth."""

import numpy as np

import torquer
from torquer.scenario.change import with_values
from torquer.telemetry.quantities import session_of
from torquer.telemetry.twin_flights import INERTIA

_ELEMENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
NOISE_T = 50e-9


def believed(gain):
    """Chibis-M, with another gain."""
    scenario = torquer.load_scenario("examples/chibis_m_detumble.toml")
    return with_values(scenario, {"control.law.gain_a_m2_s_per_t": gain})


def tip_off(scenario, seed, minutes, rate_deg_s, wrong=0.25):
    """Telemetry, a row each 30 s, of a satellite whose inertia and gain are other than in a
    scenario, by up to a part `wrong`; and its parameters by name."""
    rng = np.random.default_rng(seed)
    root = np.diag(np.sqrt(np.exp(rng.uniform(-wrong, wrong, 3))))
    inertia = root @ np.array(scenario.spacecraft.body.inertia_kg_m2) @ root
    gain = scenario.control.law.gain_a_m2_s_per_t * np.exp(rng.uniform(-wrong, wrong))
    dipole, q = 0.03 * rng.normal(size=3), rng.normal(size=4)
    flown = with_values(
        scenario,
        {
            "seed": seed,
            "simulation": {"duration_s": 60.0 * minutes, "record_s": 30.0},
            "initial": {
                "quaternion": (q / np.linalg.norm(q)).tolist(),
                "rate_deg_s": rate_deg_s,
            },
            "spacecraft.body.inertia_kg_m2": inertia.tolist(),
            "control.law.gain_a_m2_s_per_t": gain,
            "spacecraft.coils.residual_dipole_a_m2": dipole.tolist(),
        },
    )
    # nothing is read at the first and the last instant of a run
    result = torquer.simulate(flown).isel(time=slice(1, -1))
    data = session_of(
        result["utc"].values,
        {name: result[name].values for name in ("b_measured", "omega_measured")},
        source="simulated",
    )
    true = dict(zip((f"inertia_{each}" for each in INERTIA), inertia[_ELEMENTS], strict=True))
    true |= {"gain": gain} | {f"dipole_{c}": d for c, d in zip("xyz", dipole, strict=True)}
    return data, true


def errors(twin, true):
    """Errors of what a twin states [n], and over their standard deviations."""
    off = np.array([
        twin.of(name) - true[name.removesuffix("/gain")] / (true["gain"] if "/" in name else 1.0)
        for name in twin.names
    ])  # fmt: skip
    return off, off / np.array(list(twin.sigmas.values()))
