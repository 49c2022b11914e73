"""Artificial datasets of campaigns, as `torquer campaign` makes them."""

import json

import numpy as np
import xarray as xr

OUTCOMES = {
    "settling_s": ("rate_deg_s", {"settles_below": 1.0}),
    "final_rate_deg_s": ("rate_deg_s", {"at_end": True}),
    "sun_part": ({"axis": [0.0, 0.0, 1.0], "to": "sun"}, {"part_below": 10.0}),
    "coil_energy_j": ("coil_energy_j", None),
}
VARIED = {
    "initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.0, 10.0]}},
    "initial.attitude": {"rotation": "uniform"},
    "start": {"uniform": ["2027-01-01T00:00:00Z", "2028-01-01T00:00:00Z"]},
    "spacecraft.magnetometer.noise_nt": {"log_uniform": [1.0, 1000.0], "values": None},
    "control.kind": {"values": ["bdot", "detumble"]},
}


def artificial(members=60, failed=(), seed=1, factor=1.0, name="tumbling", first=0):
    """A campaign whose settling time is proportional to the initial rate, with some noise.

    `failed`: rows of members whose runs failed.
    """
    inputs = _inputs(members, seed)
    failing = np.isin(np.arange(members), failed)
    rate = np.linalg.norm(inputs["initial.rate_deg_s"], axis=1)
    t = np.linspace(0.0, 6000.0, 50)
    series = rate[:, None] * np.exp(-t / (300.0 * factor)) + 0.01
    angle = 90.0 * np.exp(-t / 2000.0) * np.ones((members, 1))
    noise = np.random.default_rng(seed + 1).normal(size=members)
    values = {
        "settling_s": np.where(rate > 9.0, np.nan, factor * 300.0 * rate + 60.0 * noise),
        "final_rate_deg_s": 0.01 * np.exp(noise),
        "sun_part": np.clip(0.8 + 0.1 * noise, 0.0, 1.0),
        "coil_energy_j": 50.0 + rate**2 * factor,
    }
    data = {key: _input(key, each) for key, each in inputs.items()}
    data["seed"] = ("member", np.arange(members))
    for key, each in values.items():
        signal, what = OUTCOMES[key]
        attrs = {"role": "outcome", "signal": json.dumps(signal), "what": json.dumps(what)}
        data[key] = ("member", np.where(failing, np.nan, each), attrs)
    for key, each in (("settling_s", series), ("final_rate_deg_s", series), ("sun_part", angle)):
        each = np.where(failing[:, None], np.nan, each).astype(np.float32)
        long_name = "angle to sun" if key == "sun_part" else "rate_deg_s"
        data[f"series.{key}"] = (("member", "time"), each, {"role": "series",
                                                            "long_name": long_name})  # fmt: skip
    good = (data["settling_s"][1] < 2400.0) & (data["sun_part"][1] > 0.7)
    data["succeeded"] = ("member", good.astype(np.int8))
    data["how_it_ended"] = ("member", np.where(failing, "failed", "complete"))
    data["ended"] = ("member", np.where(failing, "rate <exceeded> 100 deg/s", "the end"))
    coords = {"member": np.arange(first, first + members, dtype=np.int64), "time": t}
    return xr.Dataset(data, coords, attrs=_attrs(name, members, seed))


def _inputs(members: int, seed: int) -> dict:
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(members, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    quaternions = rng.normal(size=(members, 4))
    start = np.datetime64("2027-01-01", "ns")
    return {
        "initial.rate_deg_s": directions * rng.uniform(0.0, 10.0, (members, 1)),
        "initial.attitude": quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        "start": start + (rng.uniform(size=members) * 3e16).astype("timedelta64[ns]"),
        "spacecraft.magnetometer.noise_nt": 10.0 ** rng.uniform(0.0, 3.0, members),
        "control.kind": np.where(rng.uniform(size=members) < 0.5, "bdot", "detumble"),
    }


def _input(key: str, values: np.ndarray):
    dims = ("member",) if values.ndim == 1 else ("member", f"{key}.axis")
    return dims, values, {"role": "input"}


def _attrs(name: str, members: int, seed: int) -> dict:
    table = {
        "runs": members,
        "seed": seed,
        "sampling": "random",
        "vary": VARIED,
        "correlated": [],
        "outcomes": {},
        "success": {"settling_s": {"below": 2400.0}, "sun_part": {"above": 0.7, "below": None}},
        "stop": {"outcome": "settling_s", "half_width": 120.0, "confidence": 0.95, "least": 10},
    }
    return {
        "scenario": json.dumps({"name": name, "description": "From <rest> & back"}),
        "campaign": json.dumps(table),
        "versions": json.dumps({"torquer": "1"}),
    }
