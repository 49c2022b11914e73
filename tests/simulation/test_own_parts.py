"""Parts of the user's own are flown like built-in ones: resumed, in campaigns, refused, hashed."""

import subprocess
import sys

import numpy as np
import pytest
from own_parts import (
    AIR,
    CIRCULAR,
    EVERY,
    LEAK,
    RING,
    SENSOR,
    TEXT,
    WHOLE,
    all_parts,
    of_key,
    scenario_maker,
    write,
)

import torquer
from torquer.analysis.budget import budget_along_run
from torquer.base.explain import ScenarioError
from torquer.base.user_code import admit
from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import campaign_from_data
from torquer.cli.loading import check_code, find_code
from torquer.cli.options import CodeOptions
from torquer.compile import engine
from torquer.environment.field import FIELDS
from torquer.simulation.results.file import load, save
from torquer.simulation.setup.simulate import RunStopped, resume, simulate

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture
def scenario(tmp_path):
    """A function that makes the scenario of some lines, beside files of parts."""
    return scenario_maker(tmp_path)


def test_an_orbit_of_a_function_is_the_built_in_one(scenario):
    own, other = simulate(scenario(RING)), simulate(scenario(CIRCULAR))
    assert np.abs(own["position_inertial"] - other["position_inertial"]).max() < 0.05
    assert np.abs(own["q_body_to_inertial"] - other["q_body_to_inertial"]).max() < 1e-7


def test_a_torque_of_a_function_is_the_built_in_one(scenario):
    own = simulate(scenario(LEAK))
    other = simulate(scenario("disturbance.constant_torque_n_m = [1e-6, 0.0, 0.0]"))
    none = simulate(scenario())
    apart = np.abs(own["omega_body"] - other["omega_body"]).max()
    assert apart < 1e-8 * np.abs(none["omega_body"] - other["omega_body"]).max() + 1e-12


def test_a_torque_in_time_and_by_the_rate_is_that_of_euler_equations(scenario):
    """About z of a body at rest: J w' = g t - d w, in closed form."""
    lines = LEAK.replace(" }", ", parameters = { size = 0.0, damping = 1e-5, growth = 1e-9 } }")
    still = scenario(lines, "environment.gravity_gradient = false").replace(
        "initial.rate_deg_s", (0.0, 0.0, 0.0)
    )
    found = simulate(still)
    t, rate, force = found["time"].values, 1e-5 / 0.01, 1e-9 / 0.01
    expected = force / rate * (t - (1.0 - np.exp(-rate * t)) / rate)
    assert found["omega_body"].values[:, 2] == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_a_torque_that_jumps_needs_fixed_steps(scenario, tmp_path):
    write(tmp_path, TEXT.replace("size - damping * x", "size if here.t_s < 400.0 else 0.0"))
    steps = {"duration_s": 900.0, "record_s": 5.0, "step_s": 1.0}
    found = simulate(scenario(LEAK).replace("simulation", steps))
    assert found.attrs["how_it_ended"] == "complete"
    with pytest.raises(RunStopped, match=r"if disturbance\.own\.leak jumps, fixed steps"):
        simulate(scenario(LEAK))


@torquer.law(log={"read": "1", "light": "1"}, memory={"read": 0.0, "light": 0.0})
def reading(inputs, parameters, memory):
    """A law that keeps what the sensor reads."""
    memory.read, memory.light = inputs.own_reading[0], inputs.own_reading[2]
    return (0.0, 0.0, 0.0)


def test_a_law_reads_a_sensor_of_a_function(scenario):
    found = simulate(scenario(SENSOR), law=reading)
    error = found["law.read"].values - 2e6 * found["b_measured"].values[:, 1]
    assert 0.04 < error.std() < 0.06 and abs(error.mean()) < 0.02
    light = found["law.light"].values
    assert set(np.round(light, 6)) <= {0.0, 1.0} or ((light >= 0.0).all() and (light <= 1.0).all())
    again = simulate(scenario(SENSOR).replace("seed", 5), law=reading)
    assert not np.array_equal(again["law.read"], found["law.read"])


def test_a_failed_sensor_of_a_function_reads_nothing(scenario):
    fails = {"kind": "zeros", "from_s": 400.0}
    made = scenario(SENSOR).replace("spacecraft.own_sensor.failures", [fails])
    found = simulate(made, law=reading)
    silent = found["time"].values >= 400.0
    assert (found["law.read"].values[silent] == 0.0).all()
    assert (found["law.read"].values[~silent] != 0.0).all()


def test_everything_that_a_torque_reads_is_there(scenario):
    base = scenario(WHOLE, AIR)
    size = budget_along_run(simulate(base)).disturbance["own"]
    assert (np.abs(size).max(axis=0) > 1e-11).all()
    assert (np.abs(size).max(axis=0) < 1e-6).all()
    for key, value, message in (
        ("environment.atmosphere", None, r"environment\.atmosphere: must be given for disturbance\."
         r"own\.all, which reads flow_body; received none"),
        ("environment.gravity_gradient", False, r"environment\.gravity_gradient: must be true for "
         r"disturbance\.own\.all, which reads up_body; received false"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            simulate(base.replace(key, value))


@pytest.mark.parametrize("key", [*EVERY, "all"])
def test_a_resumed_run_is_equal_to_the_bit(scenario, tmp_path, key):
    made = all_parts(scenario) if key == "all" else of_key(scenario, key)
    whole, part = simulate(made), simulate(made, until_s=400.0)
    save(part, tmp_path / "part.nc")
    again = resume(load(tmp_path / "part.nc"))
    for name in ("q_body_to_inertial", "omega_body", "checkpoint"):
        assert np.array_equal(whole[name], again[name], equal_nan=True)


@pytest.mark.parametrize("key", EVERY)
def test_a_run_goes_on_with_the_same_file_only(scenario, tmp_path, key):
    made = of_key(scenario, key)
    part = simulate(made, until_s=400.0)
    name = "estimate.py" if key == "control.estimator" else "own.py"
    file = tmp_path / name
    file.write_text(file.read_text() + "\n# another\n")
    with pytest.raises(ValueError, match=r"with which the run began.*edited since"):
        resume(part)


@pytest.mark.parametrize("key", EVERY)
def test_no_user_code_is_executed_where_none_may(scenario, tmp_path, key):
    made = of_key(scenario, key)
    assert set(find_code(made)) == {f"{key}.file"}
    with pytest.raises(ValueError, match=rf"^{key}\.file: must not be given with --no-user-code"):
        check_code(made, tmp_path / "s.toml", CodeOptions(no_user_code=True))
    with pytest.raises(ValueError, match=rf"^{key}\.file: must lie in the scenario's folder"):
        check_code(made, tmp_path / "other" / "s.toml", CodeOptions())


def test_a_look_at_a_result_executes_nothing(scenario, tmp_path):
    """In a process that has loaded no scenario which names the file."""
    save(simulate(all_parts(scenario)), tmp_path / "result.nc")
    (tmp_path / "own.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'w')\n{TEXT}")
    text = (
        "import sys, torquer\n"
        "from torquer.analysis.budget import budget_along_run\n"
        "result = torquer.load(sys.argv[1])\n"
        "print(len(torquer.summarise(result)))\n"
        "try:\n"
        "    budget_along_run(result)\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", text, str(tmp_path / "result.nc")], capture_output=True, text=True
    )
    assert "must be of a scenario whose code may be executed" in found.stdout, found
    assert not (tmp_path / "executed").exists()


def test_files_beside_are_those_of_their_folder_and_as_they_are_now(scenario, tmp_path):
    """A module of one name in two folders, and one that is edited in the same process."""
    text = "import numpy as np\nfrom consts import K\n\n\ndef flat(r_ecef_m, years):\n"
    text += "    return np.full(r_ecef_m.shape, K * 1e-5)\n"
    found = []
    for folder, value in (("b", 1.0), ("c", 2.0), ("c", 3.0)):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "own.py").write_text(text)
        (tmp_path / folder / "consts.py").write_text(f"K = {value}  # {'x' * int(value)}\n")
        part = FIELDS["user"](kind="user", file=tmp_path / folder / "own.py")
        admit(part)
        found.append(part.b_earth_fixed(part.prepare(2025.0), np.full((1, 3), 7e6))[0, 0])
    assert found == pytest.approx([1e-5, 2e-5, 3e-5])


def test_an_own_torque_excludes_the_splitting_integrator(scenario):
    with pytest.raises(ScenarioError, match=r"with disturbance\.own\.leak; received 'splitting'"):
        scenario(LEAK).replace(
            "simulation", {"duration_s": 900.0, "step_s": 1.0, "integrator": "splitting"}
        )


def test_own_parts_fly_in_campaigns_with_varied_parameters(scenario, tmp_path):
    """Each member has its own parameters, and the same bits on any number of workers."""
    made = all_parts(scenario)
    sizes = {"disturbance.own.leak.parameters": {"values": [{"size": 1e-6}, {"size": 3e-6}]}}
    campaign = campaign_from_data({"runs": 8, "vary": sizes}, made)
    found = [fly_campaign(made, campaign, workers=k, to=tmp_path / f"{k}.nc") for k in (1, 2)]
    rates = [each["final_rate_deg_s"].values for each in found]
    assert np.array_equal(*rates) and len(set(rates[0])) > 1
    write(tmp_path, TEXT + "# another")
    with pytest.raises(ValueError, match=r"\.file: must be the one .* has been edited since"):
        fly_campaign(made, campaign, to=tmp_path / "1.nc", resume=True)
