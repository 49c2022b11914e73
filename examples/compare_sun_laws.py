"""My wheels died: which law brings the solar panels to the Sun with coils alone?

python examples/compare_sun_laws.py [STARTS]    (10 000 unless given; writes sun-laws.png)
"""

import sys
import tomllib
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import torquer

HERE = Path(__file__).parent
INERTIA = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
#: The modes of SDOT, Fig. 3.18: damping, rest in the shadow, S-dot reversed where it is caught the
#: wrong way round.
WITH_MODES = tomllib.loads((HERE / "sun_pointing.toml").read_text(encoding="utf-8"))["control"]
#: What stands in [control] for each. Gain of S-dot: the text's; others: the best of those tried on
#: 128 starts.
LAWS = {
    "S-dot": {"laws": {"pointing": {"kind": "sdot_rate", "gain_a_m2_s": 6e3}}},
    "S-dot with its modes": WITH_MODES,
    "B-dot and panel currents": {
        "laws": {
            "pointing": {
                "kind": "panel_tracking",
                "difference_gain_n_m": 2e-5,
                "brightest_gain_n_m": 1e-4,
            },
            "damping": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 2e7},
        },
    },
    "B-dot and cross product": {
        "laws": {
            "pointing": {"kind": "sun_cross", "gain_n_m": 3e-5},
            "damping": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e7},
        },
    },
    "spin, then to the Sun": {
        "laws": {
            "pointing": {
                "kind": "spin_to_sun",
                "gain_n_m": 1e-4,
                "momentum_n_m_s": 0.05,
                "inertia_kg_m2": INERTIA,
                "begin_deg": 10,
            },
        },
    },
}


def fly(name: str, starts: int):
    """The campaign with the law of this name. (With modes, they fly one by one.)"""
    scenario, campaign = torquer.load_campaign(HERE / "sun_laws.toml")
    scenario = scenario.replace("control", LAWS[name] | {"sample_s": scenario.control.sample_s})
    with warnings.catch_warnings(category=UserWarning, action="ignore"):
        return torquer.fly_campaign(scenario, campaign.model_copy(update={"runs": starts}))


def row(name: str, flown) -> str:
    """A row of the table."""
    error, capture_h = flown.error_deg.values, flown.capture_s.values / 3600.0
    middle, high = np.percentile(error, [50, 90])
    return (
        f"{name:25s} {100 * np.mean(error < 30.0):8.1f} % {100 * np.mean(error > 150.0):5.1f} % "
        f"{middle:9.1f} / {high:5.1f} deg {np.nanmedian(capture_h):8.2f} h "
        f"{np.median(flown.energy_j.values) / 1e3:8.2f} kJ"
    )


def draw(name: str, flown, left, right) -> None:
    """A law's line in both pictures: where the axis ends, and when it first came near the Sun."""
    left.hist(flown.error_deg, np.arange(0, 181, 5), histtype="step", label=name, density=True)
    first = np.sort(np.nan_to_num(flown.capture_s.values / 3600.0, nan=np.inf))
    right.step(first, np.arange(1, len(first) + 1) / len(first), label=name)


def main(starts: int) -> None:
    """Fly every law from the same starts; a row of the table each, and a picture."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    print("law                       at the Sun  away  error 50 % / 90 %  capture 50 %  energy")
    for name in LAWS:
        flown = fly(name, starts)
        print(row(name, flown))
        draw(name, flown, left, right)
    left.set(xlabel="mean angle of the axis to the Sun, last 6 h [deg]", ylabel="density [1/deg]")
    right.set(xlabel="first within 20 deg of the Sun [h]", ylabel="part of the starts", xlim=(0, 6))
    left.legend()
    figure.savefig("sun-laws.png", dpi=120)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
