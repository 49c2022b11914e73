"""What each addition does, shown in a copy of the package that has it: `python shown.py law`.

`tests/test_added.py` adds them and runs this.
"""

import copy
import subprocess
import sys
from pathlib import Path

import numpy as np
import tomli_w

import torquer
from torquer.analysis.budget import budget_along_run
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.quaternion import angle_between
from torquer.report.flight.panels.torques import torques
from torquer.report.flight.view import make_view
from torquer.scenario.load import scenario_from_data

ROOT = Path(__file__).parents[2]

SCENARIO = {
    "start": "2026-03-04T10:31:47Z",
    "orbit": {"kind": "circular", "altitude_km": 550.0, "inclination_deg": 60.0},
    "environment": {"field": {"kind": "averaged"}, "earth_rotation": "sidereal"},
    "spacecraft": {
        "body": {"inertia_kg_m2": [1.0, 1.3, 1.7]},
        "coils": {"limit_a_m2": 3.0},
        "magnetometer": {"noise_nt": 50.0},
        "gyro": {"noise_deg_s": 0.01},
    },
    "initial": {"rate_deg_s": [0.1, -0.06, 0.08], "euler_deg": [20.0, -35.0, 70.0]},
    "control": {"law": {"kind": "off"}, "sample_s": 1.0},
    "simulation": {"duration_s": 60.0, "step_s": 1.0, "record_s": 1.0},
}


def scenario(**changes):
    """The plain scenario, with values at keys whose dots are written as `__`."""
    data = copy.deepcopy(SCENARIO)
    for dotted, value in changes.items():
        *tables, key = dotted.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return scenario_from_data(data)


def flown(**changes):
    """The run of such a scenario."""
    return torquer.simulate(scenario(**changes))


FILTER = {
    "kind": "kalman_gyro",
    "sensors": ["magnetometer", "limb"],
    "magnetometer_noise_nt": 50.0,
    "limb_noise_deg": 0.1,
    "angle_random_walk_deg_sqrt_s": 0.01,
    "rate_random_walk_deg_s_sqrt_s": 1e-4,
    "gyro_bias_sigma_deg_s": 0.05,
}
CAMERA = {"axis": [0, 0, -1], "half_field_deg": 90.0, "noise_deg": 0.1}


def flown_with(**cameras):
    """A filter with cameras whose satellite holds its third axis up."""
    upright = {"initial__euler_deg": [0.0, 0.0, 0.0], "initial__reference": "orbital"}
    more = {"control__estimator": FILTER, "simulation__record_inputs": True}
    return flown(**upright, **more, **cameras)


def sensor() -> None:
    """A filter finds the attitude by the new sensor: one, and two of them; without it none does."""
    one = flown_with(spacecraft__limb_camera=CAMERA)
    both = [CAMERA | {"name": name} for name in ("left", "right")]
    for result in (one, flown_with(spacecraft__limb_cameras=both)):
        q, truth = result["q_estimated"].values[1:-1], result["q_body_to_inertial"].values[1:-1]
        error_deg = np.degrees(angle_between(q, truth))
        assert error_deg.max() < 1.0 and error_deg[-10:].mean() < 0.2, error_deg
    r = one["position_inertial"].values
    nadir = to_body(one["q_body_to_inertial"].values, -r / np.linalg.norm(r, axis=1)[:, None])
    off = np.linalg.norm(one["limb_measured"].values - nadir, axis=1)[:-1]
    assert 0.05 < np.degrees(np.sqrt(np.mean(off**2))) < 0.3, off
    away = flown_with(spacecraft__limb_camera=CAMERA | {"axis": [0, 0, 1]})
    assert np.isnan(away["q_estimated"].values).all()


def law() -> None:
    """The coils do what the law says, and the satellite turns more slowly."""
    damped = {"kind": "even_damping", "gain_n_m_s": 1e-3}
    result = flown(control__law=damped, spacecraft__magnetometer={}, spacecraft__gyro={})
    m, b = result["dipole_body"].values[1], result["b_body"].values[1]
    omega = result["omega_body"].values[1]
    wanted = 1e-3 * np.cross(omega, b) / (b @ b)
    assert np.linalg.norm(m - wanted) < 0.02 * np.linalg.norm(wanted), (m, wanted)
    rate = np.linalg.norm(result["omega_body"].values, axis=1)
    assert rate[-1] < 0.99 * rate[0]


def disturbance_torque() -> None:
    """It turns the satellite, is in the budget and in the report's picture of torques."""
    k = [1000.0, 0.0, 0.0]
    iron = {"soft_iron": {"dipole_by_field_a_m2_per_t": k}}
    others = {
        "unmodelled": {"constant_n_m": 1e-7, "hold_s": 60.0},
        "constant_torque_n_m": [1e-7, 0.0, 0.0],
    }
    result, without = (
        flown(disturbance=others | iron),
        flown(disturbance=others),
    )
    assert np.abs(result["omega_body"].values - without["omega_body"].values).max() > 1e-6
    b = result["b_body"].values
    found = budget_along_run(result).disturbance["soft_iron"]
    assert np.allclose(found, np.cross(k * b, b), rtol=1e-9, atol=1e-15)
    drawn = [line.label for panel in torques(make_view(result)).panels for line in panel.lines]
    assert {"soft iron", "unmodelled", "constant, random"} <= set(drawn), drawn


def telecommand() -> None:
    """The satellite obeys and answers."""
    sys.path[:0] = [str(ROOT / "tests")]
    from onboard_ground import flying

    ground = flying(60.0, file=str(ROOT / "examples/chibis_m_day.toml"))
    clock = ground.core.state.clock
    seen = [clock.now_ms for _ in range(3) if ground.tick() is not None]
    answer = ground.command("round_clock", 3_600_000, times=4)
    assert answer is not None and answer["code"] == 0, answer
    assert clock.now_ms < seen[-1] < seen[-1] + 4 * (seen[-1] - seen[-2])
    assert ground.command("round_clock", 0)["code"] != 0


def report_panel() -> None:
    """The report of a run draws it."""
    torquer.write_report(flown(), "shown")
    text = Path("shown/report.html").read_text(encoding="utf-8")
    assert "Energy of the rotation" in text and "Of the body alone." in text


def scenario_key() -> None:
    """It changes the field of the run."""
    plain, twice = flown(), flown(environment__field_factor=2.0)
    assert np.allclose(twice["b_inertial"], 2.0 * plain["b_inertial"], rtol=1e-6, atol=0.0)


def signal() -> None:
    """A condition looks at it: a state is left when its value says so."""
    when = {"signal": "rate_across_deg_s", "below": 0.1}
    states = {
        "fast": {"laws": ["damping"], "transitions": [{"to": "slow", "when": when}]},
        "slow": {"laws": ["off"]},
    }
    gain = 3e6
    laws = {"damping": {"kind": "bdot_rate", "gain_a_m2_s_per_t": gain}, "off": {"kind": "off"}}
    modes = {"axis": [0.0, 0.0, 1.0], "states": states}
    result = flown(
        control={"laws": laws, "modes": modes, "sample_s": 1.0}, spacecraft__gyro={},
        simulation__duration_s=120.0,
    )  # fmt: skip
    across = np.degrees(np.linalg.norm(result["omega_body"].values[:, :2], axis=1))
    state = result["mode_main"].values
    left = int(np.flatnonzero(state != state[0])[0])
    assert across[left - 2] >= 0.1 > across[left + 1], (left, across)


def command_option() -> None:
    """The command takes it, does what it says, and its help names it."""
    Path("plain.toml").write_text(tomli_w.dumps(SCENARIO), encoding="utf-8")
    assert "rate" in printed("run", "plain.toml", "--no-report")
    assert printed("run", "plain.toml", "--no-report", "--overwrite", "--no-summary") == ""
    assert Path("runs/plain/summary.json").exists()
    assert "--no-summary" in printed("run", "--help")


def printed(*arguments: str) -> str:
    """What a command writes to standard output; it succeeds."""
    torquer = [sys.executable, "-m", "torquer", *arguments]
    return subprocess.run(torquer, check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    globals()[sys.argv[1]]()
