"""Random satellites with filters, sound ones and wrong ones: the verdict against the truth.

`python tests/analysis/filters/random_filters.py 1000` prints how often each verdict was given to
filters
that are honest, and to those that are not. The verdict is that of `filter-check` with 16 runs; the
truth comes from 32 other runs, whose random numbers the check has not seen.
"""

import collections
import sys

import numpy as np

from torquer.analysis.filters.filter_check import check_filter
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import Start, make_members
from torquer.scenario.load import scenario_from_data

CHECKED, FLOWN = 16, 32
START = Start()
#: A filter is false where its errors, root mean square, exceed what it states by more than this
#: factor, or 4 sigma in more than this share of the instants.
FACTOR, SHARE = 1.25, 0.01
INERTIA = [1.0, 1.3, 1.7]
SUN_AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]


def drawn(number: int) -> tuple[dict, str]:
    """Data of a scenario, and what is wrong with it ('' for nothing)."""
    rng = np.random.default_rng([2026, number])
    noise_nt, sun_deg, gyro_deg_s = 50.0 * 4 ** rng.random(), 0.1 * 10 ** rng.random(), 0.01
    rate_deg_s = 10.0 ** rng.uniform(-2.0, 0.9)
    direction = rng.normal(size=3)
    spacecraft = {
        "body": {"inertia_kg_m2": INERTIA},
        "magnetometer": {"noise_nt": noise_nt},
        "gyro": {"noise_deg_s": gyro_deg_s, "bias_drift_deg_s_sqrt_s": 1e-4},
        "sun_sensors": {"axes": SUN_AXES, "half_field_deg": 60.0, "noise_deg": sun_deg},
    }
    data = {
        "seed": number,
        "start": f"2026-{rng.integers(1, 13):02d}-{rng.integers(1, 28):02d}T10:31:47Z",
        "orbit": {
            "kind": "circular",
            "altitude_km": float(rng.uniform(400.0, 900.0)),
            "inclination_deg": float(rng.uniform(10.0, 98.0)),
            "raan_deg": float(rng.uniform(0.0, 360.0)),
        },
        "environment": {"field": {"kind": "igrf14", "degree": 4}},
        "spacecraft": spacecraft,
        "initial": {"rate_deg_s": (rate_deg_s * direction / np.linalg.norm(direction)).tolist()},
        "control": {
            "law": {"kind": "off"},
            "sample_s": 1.0,
            "estimator": estimator(rng, noise_nt, sun_deg, gyro_deg_s, rate_deg_s),
        },
        "simulation": {"duration_s": 3600.0, "step_s": 1.0, "record_s": 30.0},
    }
    if data["control"]["estimator"]["kind"] == "kalman_dynamics":
        data["disturbance"] = {"random_torque_n_m": 1e-6, "random_hold_s": 1.0}
    delays(rng, data)
    wrong = [] if rng.random() < 0.4 else corrupted(rng, data)
    return data, " + ".join(wrong)


def estimator(rng, noise_nt, sun_deg, gyro_deg_s, rate_deg_s) -> dict:
    """A filter that knows the noise."""
    sensors = (["magnetometer", "sun"], ["magnetometer"])[int(rng.random() < 0.25)]
    keys = {"sensors": sensors, "magnetometer_noise_nt": noise_nt}
    if "sun" in sensors:
        keys["sun_noise_deg"] = sun_deg
    if rng.random() < 0.5:
        return keys | {
            "kind": "kalman_gyro",
            "angle_random_walk_deg_sqrt_s": gyro_deg_s,
            "rate_random_walk_deg_s_sqrt_s": 1e-4,
            "gyro_bias_sigma_deg_s": 0.05,
        }
    return keys | {
        "kind": "kalman_dynamics",
        "inertia_kg_m2": INERTIA,
        "torque_noise_n_m_sqrt_s": 1e-6,
        "rate_sigma_deg_s": max(0.2, 1.5 * rate_deg_s),
    }


def delays(rng, data) -> None:
    """Sensors with sampling and delays of their own, which the computer knows."""
    for sensor in ("magnetometer", "sun_sensors"):
        if rng.random() < 0.5:
            sample_s = float(rng.choice([1.0, 2.0, 5.0]))
            delay_s = min(float(rng.choice([0.0, 1.0, 2.0])), sample_s)
            data["spacecraft"][sensor] |= {"sample_s": sample_s, "delay_s": delay_s}


def corrupted(rng, data) -> list[str]:
    """Make one or two things in a scenario other than the filter assumes; names of them."""
    craft, names = data["spacecraft"], []
    has_gyro = data["control"]["estimator"]["kind"] == "kalman_gyro"
    for _ in range(1 + int(rng.random() < 0.3)):
        kinds = ["noise", "bias", "scale", "misalignment", "failure", "models"]
        kind = str(rng.choice(kinds))
        sensors = ["magnetometer", "sun_sensors"] + ["gyro"] * has_gyro
        sensor = str(rng.choice(sensors))
        own = craft[sensor]
        if kind == "noise":
            key = {"magnetometer": "noise_nt", "sun_sensors": "noise_deg", "gyro": "noise_deg_s"}
            own[key[sensor]] *= float(rng.choice([0.3, 2.0, 5.0, 10.0]))
        elif kind == "bias" and sensor != "gyro":
            key, size = ("bias_nt", 300.0) if sensor == "magnetometer" else ("bias_deg", 0.5)
            own[key] = [size * float(10 ** rng.uniform(-1, 1))] * 3
        elif kind == "scale" and sensor != "sun_sensors":
            own["scale_error"] = [float(10 ** rng.uniform(-4, -1.5))] * 3
        elif kind == "misalignment" and sensor != "sun_sensors":
            own["misalignment_deg"] = [float(10 ** rng.uniform(-1, 0.5))] * 3
        elif kind == "failure":
            from_s = float(rng.uniform(300.0, 3000.0))
            until_s = {} if rng.random() < 0.3 else {"until_s": from_s + 10 ** rng.uniform(1, 2.7)}
            what = str(rng.choice(["zeros", "stuck", "silent", "nan"]))
            own["failures"] = [{"kind": what, "from_s": from_s, **until_s}]
            kind = what
        elif kind == "models":
            data["control"]["ephemeris"] = {"field": {"kind": "igrf14", "degree": 1}}
            sensor = "field"
        else:
            continue
        names.append(f"{sensor} {kind}")
    return names


def truth(scenario) -> tuple[bool, float, float]:
    """(Whether the filter is false, rms error over stated, share of instants beyond 4 sigma)."""
    other = scenario.replace("seed", scenario.seed + 10**6)
    flown = fly_filter(make_members(other, FLOWN, START))
    later = flown.t_s >= 0.1 * flown.t_s[-1]
    error = np.sum(flown.errors[:, later, :3] ** 2, axis=2)
    stated = np.einsum("rkii->rk", flown.covariance[:, later, :3, :3])
    known = np.isfinite(error)
    if not known.any():
        return False, np.nan, 0.0
    ratio = error[known] / np.minimum(stated[known], np.pi**2 / 3.0)
    sizes = np.sqrt(np.mean(ratio)), np.mean(ratio > 16.0)
    return bool(sizes[0] > FACTOR or sizes[1] > SHARE), float(sizes[0]), float(sizes[1])


def judged(number: int) -> tuple[str, bool, str, float, float]:
    """(Verdict, whether the filter is false, what is wrong, the two sizes of `truth`)."""
    data, wrong = drawn(number)
    scenario = scenario_from_data(data)
    false, factor, share = truth(scenario)
    word = check_filter(scenario, CHECKED, start=START).verdict.word
    return word, false, wrong, factor, share


def main(count: int) -> None:
    """Print the table, and every false filter that was called consistent."""
    table, missed = collections.Counter(), []
    for number in range(count):
        word, false, wrong, factor, share = judged(number)
        table[word, false, bool(wrong)] += 1
        row = f"{number} {word}: {factor:.2f} of stated, {share:.1%} over 4 sigma; {wrong}"
        print(row, file=sys.stderr, flush=True)
        if false and word == "consistent":
            missed.append((number, wrong, factor, share))
    for (word, false, wrong), how_often in sorted(table.items()):
        print(f"{word:15} {'false' if false else 'honest':7} "
              f"{'something wrong' if wrong else 'as assumed':16} {how_often:5}")  # fmt: skip
    print(f"false, but called consistent: {len(missed)} of {count}")
    for number, wrong, factor, share in missed:
        print(
            f"  {number}: {wrong or 'as assumed'}; {factor:.2f} of stated, {share:.1%} over 4 sigma"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]))
