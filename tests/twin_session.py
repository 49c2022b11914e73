"""Tip-offs of satellites that are not as believed: telemetry of simulated flights, the truth."""

import numpy as np

import torquer
from torquer.ground.telemetry.reading.quantities import make_session
from torquer.ground.telemetry.twin.flights import INERTIA
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.change import with_values

_ELEMENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
_SENSORS = ("b_measured", "omega_measured", "sun_measured")
NOISE_T = 50e-9


def believed(gain):
    """Chibis-M, with another gain."""
    scenario = torquer.load_scenario("examples/chibis_m_detumble.toml")
    return with_values(scenario, {"control.law.gain_a_m2_s_per_t": gain})


def tip_off(scenario, seed, minutes, rate_deg_s, wrong=0.25, sun=False):
    """Telemetry, a row each 30 s, of a satellite whose inertia and gain are other than in a
    scenario, by up to a part `wrong`; and its parameters by name, with its own scenario. `sun`:
    with Sun sensors, too."""
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
    data = make_session(
        result["utc"].values,
        {name: result[name].values for name in _SENSORS[: 3 if sun else 2]},
        source="simulated",
    )
    true = dict(zip((f"inertia_{each}" for each in INERTIA), inertia[_ELEMENTS], strict=True))
    true |= {f"dipole_{c}": d for c, d in zip("xyz", dipole, strict=True)}
    true |= {"gain": gain, "scenario": flown}
    return data, true


def errors(twin, true):
    """Errors of what a twin states [n], and over their standard deviations."""
    off = np.array([
        twin.of(name) - true[name.removesuffix("/gain")] / (true["gain"] if "/" in name else 1.0)
        for name in twin.names
    ])  # fmt: skip
    return off, off / np.array(list(twin.sigmas.values()))


def departure(twin, true):
    """What the true satellite differs by from a twin, as deviations of its members [n]: motion at
    the start of the last leg, inertia, gain if it is known, residual dipole. Where only inertia
    over gain is known, those of a true satellite with the twin's gain."""
    after_s = (twin.onward.start - true["scenario"].start).total_seconds()
    timing = {"duration_s": after_s, "record_s": 9.0}
    flown = torquer.simulate(with_values(true["scenario"], {"simulation": timing})).isel(time=-1)
    initial, law = twin.onward.initial, twin.onward.control.law
    turn = rotation_vector(np.array([initial.quaternion]), flown["q_body_to_inertial"].values[None])
    rate = np.degrees(flown["omega_body"].values) - initial.rate_deg_s
    gain = law.gain_a_m2_s_per_t
    size = gain / true["gain"] if twin.only_ratio else 1.0
    inertia = [size * true[f"inertia_{each}"] for each in INERTIA]
    dipole = [size * true[f"dipole_{c}"] for c in "xyz"]
    inertia -= np.array(twin.onward.spacecraft.body.inertia_kg_m2)[_ELEMENTS]
    dipole -= np.array(twin.onward.spacecraft.coils.residual_dipole_a_m2)
    log_gain = [np.log(true["gain"] / gain)] if "gain" in twin.names else []
    return np.concatenate([turn[0], rate, inertia, log_gain, dipole])
