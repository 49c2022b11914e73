"""Coils and computers that fail during the run: the motion follows, the computer believes."""

import numpy as np
import pytest

from torquer import Law, ScenarioError, simulate
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

RUN = {"duration_s": 60.0, "step_s": 1.0, "record_s": 1.0}
WANTED = (0.5, -1.0, 2.0)
COILS = {"limit_a_m2": 3.0, "power_at_limit_w": 9.0}  # 1 W/(A m^2)^2


def flown(make, coils=(), computer=(), control=None, wanted=lambda t_s: WANTED):
    """(Result, inputs at the control steps) of a law that asks for a dipole."""
    seen = []

    def ask(inputs, parameters, memory):
        seen.append(inputs)
        memory[0] += 1.0
        return wanted(inputs.t_s)

    changes = {"simulation": RUN, "spacecraft.coils": COILS | {"failures": list(coils)}}
    changes |= {"control": {"law": {"kind": "off"}, "failures": list(computer), **(control or {})}}
    return simulate(make(changes), Law("ask", ask, memory=1, compiled=False)), seen


@pytest.mark.parametrize(
    ("kind", "gives"),
    [({"kind": "dead"}, 0.0), ({"kind": "reversed"}, -2.0),
     ({"kind": "stuck", "dipole_a_m2": -1.5}, -1.5)],
)  # fmt: skip
def test_a_coil_fails_and_recovers(make, kind, gives):
    result, seen = flown(make, [{"coil": 2, **kind, "from_s": 20.0, "until_s": 30.0}])
    dipole = np.tile(WANTED, (61, 1))
    dipole[20:30, 2] = gives
    assert np.array_equal(result.dipole_body.values, dipole)
    assert np.array_equal(result.command_body.values, np.tile(WANTED, (61, 1)))
    believed = np.array([inputs.coil_dipole_body_a_m2 for inputs in seen[1:]])
    assert np.array_equal(believed, np.tile(WANTED, (59, 1)))
    power = 0.25 + 1.0 + np.where(np.arange(60) // 10 == 2, gives**2, 4.0)
    assert float(result.coil_energy) == pytest.approx(power.sum(), rel=1e-12)


def test_the_torque_is_that_of_the_dipole_that_is_there(make):
    """A coil that is stuck on is one commanded to be so: same motion to the bit."""
    stuck, _ = flown(make, [{"coil": k, "kind": "stuck", "dipole_a_m2": 1.0} for k in range(3)])
    commanded, _ = flown(make, wanted=lambda t_s: (1.0, 1.0, 1.0))
    assert np.array_equal(stuck.omega_body.values, commanded.omega_body.values)
    healthy, _ = flown(make)
    assert not np.array_equal(stuck.omega_body.values[-1], healthy.omega_body.values[-1])


def test_stuck_coil_stays_on_while_the_magnetometer_reads(make):
    windows = {"sample_s": 1.0, "measure_s": 2.0, "actuate_s": 3.0}
    result, _ = flown(
        make, [{"coil": 0, "kind": "stuck", "dipole_a_m2": 2.5, "from_s": 12.0}], control=windows
    )
    dipole, measures = result.dipole_body.values[:-1], np.arange(60) % 5 < 2
    assert np.array_equal(dipole[:, 1], np.where(measures, 0.0, WANTED[1]))
    late = np.arange(60) >= 12
    assert np.array_equal(dipole[:, 0], np.where(late, 2.5, np.where(measures, 0.0, WANTED[0])))


def test_coils_with_a_lag_fail_as_slowly_as_they_follow(make):
    failure = [{"coil": 1, "kind": "dead", "from_s": 40.0}]
    result, _ = flown(lambda changes: make(changes | {"spacecraft.coils.lag_s": 4.0}), failure)
    t = np.arange(61)
    before, after = -1.0 * -np.expm1(-t[:41] / 4.0), -1.0 * -np.expm1(-10.0) * np.exp(-t[:21] / 4.0)
    expected = np.concatenate([before, after[1:]])
    assert result.dipole_body.values[:, 1] == pytest.approx(expected, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("kind", ["halted", "restarted"])
def test_a_halted_computer_leaves_its_last_command(make, kind):
    def ramp(t_s):
        return (0.01 * t_s, 0.0, 0.0)

    failure = {"kind": kind, "from_s": 20.0, "until_s": 30.0}
    result, seen = flown(make, computer=[failure], wanted=ramp)
    t = np.arange(60.0)
    worked = (t < 20) | (t >= 30)
    assert [inputs.t_s for inputs in seen] == t[worked].tolist()
    assert result.dipole_body.values[:60, 0] == pytest.approx(0.01 * np.where(worked, t, 19.0))
    back = seen[20]  # its coils had the last command all the time
    assert back.coil_dipole_body_a_m2 == pytest.approx((0.19, 0.0, 0.0), rel=1e-12)
    assert back.read_at.magnetometer_s == 30.0


def test_halted_computer_leaves_its_coils_on_during_a_measurement(make):
    windows = {"sample_s": 1.0, "measure_s": 2.0, "actuate_s": 3.0}
    halted = [{"kind": "halted", "from_s": 14.0, "until_s": 26.0}]
    result, _ = flown(make, computer=halted, control=windows)
    t = np.arange(60)
    on = (t % 5 >= 2) | ((t >= 14) & (t < 27))  # at 26 s it measures, with the coils still on
    assert np.array_equal(result.dipole_body.values[:60, 0], np.where(on, WANTED[0], 0.0))


MODES = {
    "sample_s": 1.0,
    "estimator": {"kind": "rate_from_field"},
    "laws": {"damping": {"kind": "bdot", "gain_a_m2_s_per_t": 1e4}},
    "modes": {
        "states": {
            "first": {"laws": ["damping"], "transitions": [{"to": "then", "at_least_s": 12.0}]},
            "then": {"set": {"damping.gain": 1e5}, "laws": ["damping"]},
        }
    },
}


@pytest.mark.parametrize(("kind", "again"), [("halted", 0), ("restarted", 1)])
def test_a_restart_loses_modes_parameters_and_memory(make, kind, again):
    """A restarted computer does what a fresh one does, from the satellite's state on."""
    failure = [{"kind": kind, "from_s": 20.0, "until_s": 30.0}]
    changes = {"simulation": RUN, "spacecraft.coils": COILS, "spacecraft.magnetometer": {}}
    result = simulate(make(changes | {"control": MODES | {"failures": failure}}))
    modes = np.array([0] * 12 + [1] * 49)
    if again:
        modes[30:42] = 0
    assert np.array_equal(result.mode_main.values, modes)
    assert np.isnan(result.omega_estimated.values[30]).any() == bool(again)
    gains = np.linalg.norm(result.command_body.values, axis=1)
    assert (gains[35] < 0.3 * gains[15]) == bool(again)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"spacecraft.coils.failures": [{"coil": 3, "kind": "dead"}]},
         "spacecraft.coils.failures[0].coil: must be the number of a coil, 0 to 2; received 3"),
        ({"spacecraft.coils.failures": [{"coil": 0, "kind": "stuck"}]},
         "failures[0].dipole_a_m2: must be given for kind 'stuck'; received none"),
        ({"spacecraft.coils.failures": [{"coil": 0, "kind": "dead", "dipole_a_m2": 1.0}]},
         "dipole_a_m2: must be left out for kind 'dead'; received 1.0"),
        ({"spacecraft.coils.failures": [{"coil": 1, "kind": "stuck", "dipole_a_m2": -4.0}]},
         "must not exceed the limit of coil 1, 3 A m^2; received -4 A m^2"),
        ({"spacecraft.coils.failures": [{"coil": 0, "kind": "dead", "from_s": 60.0}]},
         "spacecraft.coils.failures[0].from_s: must be before the end of the run, 60 s; "),
        ({"control.failures": [{"kind": "halted", "from_s": 99.0}]},
         "control.failures[0].from_s: must be before the end of the run, 60 s; received 99 s"),
        ({"control.failures": [{"kind": "restarted"}]},
         "until_s: must be given for kind 'restarted'; received none"),
        ({"control.failures": [{"kind": "halted", "from_s": 9.0, "until_s": 8.0}]},
         "until_s: must be above from_s, 9 s; received 8 s"),
    ],
)  # fmt: skip
def test_messages(make, changes, expected):
    with pytest.raises(ScenarioError) as error:
        make({"simulation": RUN, **changes})
    assert expected in str(error.value)
