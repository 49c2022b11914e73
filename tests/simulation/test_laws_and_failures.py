"""Laws of the user's own in a scenario, and runs that fail: what is said and what is kept."""

import numpy as np
import pytest
from integrators import INTEGRATORS, by

import torquer
from torquer import RunStopped, load, simulate
from torquer.compile import engine
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.simulation.results.dataset import flown_laws
from torquer.simulation.results.store import InMemory
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.simulate import finish

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

LAWS = """
import math
import torquer


def plain(inputs, parameters, memory):
    memory[0] += 1.0
    b = inputs.b_body_t  # products only: a fused multiply-add would round differently
    return (3e4 * b[0], -2e4 * b[1], memory[0] * inputs.omega_body_rad_s[2])


compiled = torquer.law(plain, memory=16)


@torquer.law(parameters={"gain": 1e5, "along_z": 0.5})
def with_parameters(inputs, parameters, memory):
    return (parameters.gain * inputs.b_body_t[0], 0.0, parameters.along_z)


@torquer.law
def fails_later(inputs, parameters, memory):
    return (0.0, math.nan if inputs.t_s >= 33.0 else 0.0, 1.0)


@torquer.law
def fails_at_once(inputs, parameters, memory):
    return (math.inf, 0.0, 0.0)


@torquer.law
def huge(inputs, parameters, memory):
    return (1e300, -1e300, 2e300)


def fails_in_python(inputs, parameters, memory):
    return (math.nan if inputs.t_s >= 33.0 else 0.0, 0, 1)


def raises(inputs, parameters, memory):
    return (1 / (33.0 - inputs.t_s), 0, 0)


def leaves(inputs, parameters, memory):
    exit()


@torquer.law(memory=33)
def reads_past_the_end(inputs, parameters, memory):
    return (memory[int(inputs.t_s)], 0.0, 1.0)


@torquer.law
def divides_by_zero(inputs, parameters, memory):
    return (1.0 / (1.0 / (33.0 - inputs.t_s)), 0.0, 1.0)


@torquer.law
def raises_compiled(inputs, parameters, memory):
    if inputs.t_s > 32.0:
        raise ValueError("too late")
    return (0.0, 0.0, 1.0)


@torquer.law(memory=1)
def counts_and_raises(inputs, parameters, memory):
    memory[0] += 1.0
    if memory[0] == 34.0:
        raise ValueError
    return (0.0, 0.0, 1.0)


@torquer.law
def knows_nothing(inputs, parameters, memory):
    x = math.nan if inputs.t_s >= 33.0 else 0.0
    return (x, x, x)


def answers_two(inputs, parameters, memory):
    return (1, 2)


def answers_nothing(inputs, parameters, memory):
    pass


@torquer.law
def misspelt(inputs, parameters, memory):
    return inputs.b_body


@torquer.law
def short(inputs, parameters, memory):
    return (1.0, 2.0)


number = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The file of all laws, alone: beside another one it would be compiled again."""
    folder = tmp_path_factory.mktemp("laws")
    (folder / "laws.py").write_text(LAWS)
    return folder


@pytest.fixture
def with_law(plain_data, folder):
    """A scenario with a law of the file, or of another one in a folder of its own."""

    def build(function=None, file="laws.py", changes=(), at=folder, **extra):
        table = {"kind": "user", "file": file, **extra}
        if function:
            table["function"] = function
        changes = {"control.law": table, "simulation.duration_s": 100.0, **dict(changes)}
        return scenario_from_data(plain_data(changes), at)

    return build


WINDOW = {"control.sample_s": 2.0, "control.measure_s": 4.0, "control.actuate_s": 3.0}


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("window", [{}, WINDOW])
def test_plain_python_gives_the_bits_of_the_compiled_law(with_law, integrator, window):
    changes = (
        window
        | by(integrator)
        | {
            "simulation.record_s": 5.0,
            "spacecraft.coils.lag_s": 0.4,
            "spacecraft.magnetometer": {"noise_nt": 50.0, "coil_disturbance_nt_per_a_m2": 100.0},
            "spacecraft.gyro.bias_drift_deg_s_sqrt_s": 1e-3,
        }
    )
    fast = simulate(with_law("compiled", changes=changes))
    slow = simulate(with_law("plain", changes=changes))
    fast_law, slow_law = flown_laws(fast)["law"], flown_laws(slow)["law"]
    assert fast_law["runs_as"] == "compiled"
    assert slow_law["runs_as"] == "plain Python (slow: not decorated)"
    assert fast_law["name"] == slow_law["name"] == "plain"
    for name in fast.variables:
        equal_nan = fast[name].dtype.kind == "f"
        assert np.array_equal(fast[name].values, slow[name].values, equal_nan=equal_nan), name
    assert np.abs(fast.dipole_body.values).max() > 0.1


def test_a_plain_function_may_be_given_as_the_law(make):
    def own(inputs, parameters, memory):
        memory[15] += 1.0
        return (memory[15], memory.size, len(parameters))

    scenario = make({"simulation.duration_s": 50.0, "spacecraft.coils.limit_a_m2": 100.0})
    result = simulate(scenario, own)
    described = flown_laws(result)["law"]
    assert (described["name"], described["parameters"]) == ("own", {})
    assert described["runs_as"] == "plain Python (slow: not decorated)"
    assert result.command_body.values[-1].tolist() == [50.0, 16.0, 0.0]
    part = simulate(scenario, own, until_s=20.0)
    assert np.array_equal(torquer.resume(part, own).omega_body, result.omega_body)
    with pytest.raises(
        ValueError, match=r"law: must be a torquer.Law or a function; received 'own'"
    ):
        simulate(scenario, "own")


def test_parameters_go_by_name(with_law):
    default = simulate(with_law("with_parameters"))
    assert flown_laws(default)["law"]["parameters"] == {"gain": 100000.0, "along_z": 0.5}
    assert default.dipole_body.values[:, 2] == pytest.approx(0.5)
    other = simulate(with_law("with_parameters", parameters={"along_z": 0.25}))
    assert other.dipole_body.values[:, 2] == pytest.approx(0.25)
    assert other.dipole_body.values[0, 0] == pytest.approx(1e5 * other.b_body.values[0, 0])


def test_unknown_parameters_are_named(with_law):
    with pytest.raises(ValueError, match="must be one of: gain, along_z; received 'gian'"):
        simulate(with_law("with_parameters", parameters={"gian": 1.0}))
    with pytest.raises(ValueError, match="must be one of: none; received 'gain'"):
        simulate(with_law("plain", parameters={"gain": 1.0}))
    with pytest.raises(ScenarioError, match=r"control\.law\.parameters\.gain: must be finite"):
        with_law("with_parameters", parameters={"gain": float("nan")})


def test_the_only_law_of_a_file_needs_no_name(with_law, tmp_path):
    (tmp_path / "one.py").write_text(
        "import torquer\n@torquer.law\ndef alone(m, p, s):\n    return (0.0, 0.0, 1.0)\n"
    )
    assert flown_laws(simulate(with_law(file="one.py", at=tmp_path)))["law"]["name"] == "alone"


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            None,
            "must hold one @torquer.law, .*; received compiled, with_parameters, ",
        ),
        ("nowhere", "must be defined in the file; received 'nowhere', which is not in "),
        ("number", "must be defined in the file; received 'number', which is not in "),
        (
            "misspelt",
            "received: Inputs without a field 'b_body' .did you mean b_body_t",
        ),
        ("short", r"control\.law: must compile as \(inputs, parameters, memory\) -> \(x, y, z\)"),
    ],
)
def test_a_law_that_cannot_be_used_is_explained(with_law, function, message):
    with pytest.raises(ValueError, match=message) as caught:
        simulate(with_law(function))
    assert "\n" not in str(caught.value)


def test_a_law_file_that_cannot_be_used_is_explained(with_law, tmp_path):
    with pytest.raises(
        ValueError, match=r"control\.law\.file: must be an existing file; received .*nowhere\.py"
    ):
        simulate(with_law("plain", file="nowhere.py"))
    (tmp_path / "broken.py").write_text("def law(:\n")
    with pytest.raises(ValueError, match=r"control\.law\.file: must import; .*broken\.py, line 1"):
        simulate(with_law("law", file="broken.py", at=tmp_path))


def test_an_edited_law_is_noticed(with_law, tmp_path):
    # of another length: Python itself takes a file of the same second and length for unchanged
    for number in (1.0, 2.25):
        (tmp_path / "edited.py").write_text(
            "import torquer\nimport helper_of_edited as h\n"
            "@torquer.law\ndef edited(m, p, s):\n    return h.answer()\n"
        )
        (tmp_path / "helper_of_edited.py").write_text(
            "import numba\n@numba.njit(cache=True)\n"
            f"def answer():\n    return (0.0, 0.0, {number})\n"
        )
        import sys

        sys.modules.pop("helper_of_edited", None)
        sys.path.insert(0, str(tmp_path))
        try:
            result = simulate(with_law(file="edited.py", at=tmp_path))
        finally:
            sys.path.remove(str(tmp_path))
        assert result.dipole_body.values[-1].tolist() == [0.0, 0.0, number]


@pytest.mark.parametrize(
    ("function", "t_s", "message"),
    [
        ("fails_later", 33.0, r"return a finite dipole; received \(0, nan, 1\) at t = 33 s; q"),
        ("fails_in_python", 33.0, r"return a finite dipole; received \(nan, 0, 1\) at t = 33 s"),
        ("fails_at_once", 0.0, r"must return a finite dipole; received \(inf, 0, 0\) at t = 0 s"),
        ("raises", 33.0, r"must not raise; received ZeroDivisionError\(.*\) at t = 33 s"),
        ("leaves", 0.0, r"must not raise; received SystemExit\(.*\) at t = 0 s"),
        ("reads_past_the_end", 33.0, r"must not raise; received IndexError\(.*\) at t = 33 s; q"),
        ("divides_by_zero", 33.0, r"must not raise; received ZeroDivisionError\(.*\) at t = 33 s"),
        (
            "raises_compiled",
            33.0,
            r"must not raise; received ValueError\('too late'\) \(laws.py, line 60\) at t = 33",
        ),
        (
            "counts_and_raises",
            33.0,
            "must return finite numbers and must not raise; received nan, nan, nan, nan, nan, nan",
        ),
        (
            "knows_nothing",
            33.0,
            r"must return a finite dipole; received \(nan, nan, nan\) at t = 33 s",
        ),
        ("answers_two", 0.0, r"must return three numbers; received \(1, 2\) at t = 0 s"),
        ("answers_nothing", 0.0, "must return three numbers; received None at t = 0 s"),
    ],
)
def test_failing_law_stops_the_run_and_keeps_its_result(with_law, function, t_s, message):
    with pytest.raises(RunStopped, match=r"^control\.law: ") as stopped:
        simulate(with_law(function, changes={"simulation.record_s": 1.0}))
    place = rf"( \({function} in .*laws\.py\))? at t = "
    assert stopped.match(message.replace(" at t = ", place))
    assert "laws.py" in str(stopped.value)
    result = stopped.value.result
    assert result.time.values.tolist() == list(np.arange(0.0, t_s + 1.0))
    assert result.attrs["ended"] == str(stopped.value)
    assert (result.attrs["how_it_ended"], stopped.value.interrupted) == ("failed", False)
    assert np.isfinite(result.omega_body.values).all()
    assert "\n" not in str(stopped.value)


class Odd(Exception):
    """An error, or an answer, whose text no file can hold."""

    def __init__(self, text):
        self.text = text

    def __repr__(self):
        return self.text + "\n"


@pytest.mark.parametrize(
    ("odd", "shown"),
    [
        (Odd("a\0b"), r"a\x00b"),
        (Odd("\ud800"), r"\ud800"),
        (Odd(5), "Odd"),  # which has no text at all
        (Odd("x" * 1000), "x" * 300 + "..."),
    ],
)
def test_a_law_that_fails_in_odd_words_keeps_the_result(make, tmp_path, odd, shown):
    def raises(inputs, parameters, memory):
        raise odd

    def answers(inputs, parameters, memory):
        return odd

    for law, problem in ((raises, "must not raise"), (answers, "must return three numbers")):
        with pytest.raises(RunStopped) as stopped:
            simulate(make(), law, to=tmp_path / "result.nc", overwrite=True)
        message = str(stopped.value)
        assert message.startswith(f"law {law.__name__}: {problem}; received {shown} ")
        assert message.endswith(" at t = 0 s")
        assert load(tmp_path / "result.nc").attrs["ended"] == message


def test_an_absurd_but_finite_answer_is_scaled_to_the_limit(with_law):
    dipole = simulate(with_law("huge")).dipole_body.values[0]
    assert dipole == pytest.approx([1.5, -1.5, 3.0])


@pytest.mark.parametrize("integrator", ["rk4", "splitting"])
def test_a_state_that_blows_up_stops_the_run(make, integrator, tmp_path):
    run = prepare(make({"simulation.integrator": integrator}))
    run.state.cells["omega_x"] = 1e200  # a rate [rad/s] that no scenario may have
    problem = {
        "rk4": "simulation.step_s: must be shorter for RK4 to follow the motion from t = 0 s"
    }
    finite = "the state stopped being finite after t = "
    with pytest.raises(RunStopped, match=f"^{problem.get(integrator, finite)}") as stopped:
        finish(run, InMemory())
    assert "quaternion and rate: " in str(stopped.value)
    result = stopped.value.result
    assert 1 <= result.sizes["time"] < 60
    assert np.isfinite(result.omega_body.values).all()
    torquer.save(result, tmp_path / "result.nc")
    assert torquer.load(tmp_path / "result.nc").attrs["ended"] == str(stopped.value)


def test_a_field_model_without_that_date_stops_before_the_run(make):
    with pytest.raises(ValueError, match=r"igrf14: date must lie within 1900.0..2030.0; re"):
        simulate(make({"environment.field.kind": "igrf14", "start": "2031-03-04T00:00:00Z"}))
    late = make({"environment.field.kind": "igrf14", "start": "2029-12-31T23:59:00Z"})
    with pytest.raises(ValueError, match=r"2030.0; received 2030.0\d* at t = \d+ s$"):
        simulate(late)


def test_an_orbit_that_decays_stops_before_the_run(make):
    tle = [
        "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
        "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
    ]
    with pytest.raises(ValueError, match=r"sgp4: no orbit at t = .* error \d, "):
        simulate(make({"orbit": {"kind": "sgp4", "tle": tle}, "start": "2060-03-04T00:00:00Z"}))
