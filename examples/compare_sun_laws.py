"""My wheels died: which law brings the solar panels to the Sun with coils alone?

python examples/compare_sun_laws.py [STARTS]    (10 000 unless given; writes sun-laws.png)
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import torquer

HERE = Path(__file__).parent
INERTIA = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
#: Gains: the best of those tried on 128 starts.
LAWS = {
    "S-dot": {"pointing": {"kind": "sdot_rate", "gain_a_m2_s": 6e3}},
    "B-dot and cross product": {
        "pointing": {"kind": "sun_cross", "gain_n_m": 1e-4},
        "damping": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 4e6},
    },
    "spin, then to the Sun": {
        "pointing": {
            "kind": "spin_to_sun",
            "gain_n_m": 1e-4,
            "momentum_n_m_s": 0.05,
            "inertia_kg_m2": INERTIA,
            "begin_deg": 10,
        },
    },
}


def main(starts: int) -> None:
    """Fly every law from the same starts; a row of the table each, and a picture."""
    scenario, campaign = torquer.load_campaign(HERE / "sun_laws.toml")
    campaign = campaign.model_copy(update={"runs": starts})
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    print("law                       at the Sun  away  error 50 % / 90 %  capture 50 %  energy")
    for name, laws in LAWS.items():
        flown = torquer.fly_campaign(scenario.replace("control.laws", laws), campaign)
        error, capture_h = flown.error_deg.values, flown.capture_s.values / 3600.0
        there, away = np.mean(error < 30.0), np.mean(error > 150.0)
        middle, high = np.percentile(error, [50, 90])
        energy_kj = np.median(flown.energy_j.values) / 1e3
        print(
            f"{name:25s} {100 * there:8.1f} % {100 * away:5.1f} % {middle:9.1f} / {high:5.1f} deg "
            f"{np.nanmedian(capture_h):8.2f} h {energy_kj:8.2f} kJ"
        )
        left.hist(error, np.arange(0, 181, 5), histtype="step", label=name, density=True)
        first = np.sort(np.where(np.isnan(capture_h), np.inf, capture_h))
        right.step(first, np.arange(1, starts + 1) / starts, label=name)
    left.set(xlabel="mean angle of the axis to the Sun, last 6 h [deg]", ylabel="density [1/deg]")
    right.set(xlabel="first within 20 deg of the Sun [h]", ylabel="part of the starts", xlim=(0, 6))
    left.legend()
    figure.savefig("sun-laws.png", dpi=120)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
