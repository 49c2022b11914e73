"""Laws given to `simulate`: the result tells what was flown, and that can be flown again."""

import dataclasses
import json

import numpy as np
import pytest

import torquer
from torquer import law, load, resume, save, simulate
from torquer.compile import engine
from torquer.computer.blocks.user import GivenLaw, UserLaw, load_law
from torquer.computer.laws import Bdot
from torquer.computer.laws.off import Off
from torquer.scenario.load import ScenarioError, scenario_from_data, scenario_from_text
from torquer.simulation.results.dataset import flown_laws, flown_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

LAWS = """
import torquer


@torquer.law(parameters={"gain": 1e5, "bias": 0.5}, memory=(1.0, 0.0))
def tuned(inputs, parameters, memory):
    memory[1] += memory[0]
    return (parameters.gain * inputs.b_body_t[0], parameters.bias, 1e-3 * memory[1])


def plain(inputs, parameters, memory):
    memory[0] += 1.0
    return (1e5 * inputs.b_body_t[1], 0.0, 1e-3 * memory[0])


def made(size):
    def inner(inputs, parameters, memory):
        return (size, 0.0, 0.0)

    return inner
"""


@law(parameters={"gain": 1e5})
def in_this_package(inputs, parameters, memory):
    """A law of a module that may not load by itself: this one's."""
    return (parameters.gain * inputs.b_body_t[0], 0.0, 0.0)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """The laws, in a file that stays as it is: they are compiled once."""
    path = tmp_path_factory.mktemp("laws") / "given_laws.py"
    path.write_text(LAWS)
    return path


def same(a, b):
    """Whether two results hold the same bits and tell the same."""
    for name in a.variables:
        equal_nan = a[name].dtype.kind == "f"
        assert np.array_equal(a[name].values, b[name].values, equal_nan=equal_nan), name
    assert a.attrs == b.attrs
    return True


def of_the_file(file, name, **parameters):
    return load_law(file, name).with_parameters(**parameters)


@pytest.mark.parametrize("own", [{"kind": "off"}, {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}])
@pytest.mark.parametrize("memory", [(1.0, 0.0), (2.0, 5.0)])
def test_law_from_a_file_is_flown_again_from_the_result(make, file, own, memory, tmp_path):
    given = dataclasses.replace(of_the_file(file, "tuned", gain=3e5), memory=memory)
    result = simulate(make({"control.law": own}), given)
    save(result, tmp_path / "result.nc")
    answer = flown_scenario(load(tmp_path / "result.nc"))
    assert answer.control.law == UserLaw(
        kind="user", file=file, function="tuned", parameters={"gain": 3e5, "bias": 0.5},
        memory=None if memory == (1.0, 0.0) else memory,
    )  # fmt: skip
    assert same(simulate(answer), result)
    part = simulate(make({"control.law": own}), given, until_s=200.0)
    assert same(resume(part), result)


def test_a_given_law_replaces_the_parameters_of_the_scenarios_own(make, file):
    own = {"kind": "user", "file": str(file), "function": "tuned", "parameters": {"bias": 0.25}}
    result = simulate(make({"control.law": own}), of_the_file(file, "tuned"))
    assert result.dipole_body.values[5, 1] == pytest.approx(0.5)
    assert flown_scenario(result).control.law.parameters == {"gain": 1e5, "bias": 0.5}
    assert same(simulate(flown_scenario(result)), result)


def test_a_plain_function_of_a_file_is_flown_again(make, file):
    function = load_law(file, "plain").function
    result = simulate(make(), function)
    assert flown_scenario(result).control.law == UserLaw(kind="user", file=file, function="plain")
    assert same(simulate(flown_scenario(result)), result)


def test_a_law_of_the_package_is_reported_by_its_keys(make):
    spec = Bdot(kind="bdot", gain_a_m2_s_per_t=3e5)
    result = simulate(make(), spec.law())
    assert flown_scenario(result).control.law == spec
    assert flown_laws(result)["law"]["text"] == ""
    assert same(simulate(flown_scenario(result)), result)
    assert same(result, simulate(make({"control.law": spec.model_dump()})))


@pytest.fixture(scope="module")
def given_laws(file, tmp_path_factory):
    """Laws that are in no file to load them from, by what they are."""
    maker = vars(__import__("sys").modules[load_law(file, "plain").function.__module__])["made"]
    edited = tmp_path_factory.mktemp("edited") / "edited.py"
    edited.write_text(LAWS)
    found = of_the_file(edited, "tuned")
    edited.write_text(LAWS.replace("1e-3", "2e-3"))
    gone = tmp_path_factory.mktemp("gone") / "gone.py"
    gone.write_text(LAWS)
    lost = of_the_file(gone, "tuned")
    gone.unlink()
    own = Bdot(kind="bdot", gain_a_m2_s_per_t=3e5).law()
    return {
        "a closure": maker(0.5),
        "a lambda": lambda inputs, parameters, memory: (0.5, 0.0, 0.0),
        "another's module": in_this_package,
        "edited since": found,
        "gone": lost,
        "the package's, changed": own.with_parameters(gain=2e5),
        "more memory": dataclasses.replace(of_the_file(file, "tuned"), memory=(1.0, 0.0, 0.0)),
    }


@pytest.mark.parametrize("which", ["a closure", "a lambda", "another's module", "edited since",
                                   "gone", "the package's, changed", "more memory"])  # fmt: skip
def test_other_laws_must_be_given_again(make, given_laws, which):
    given = given_laws[which]
    result = simulate(make(), given)
    answer = flown_scenario(result).control.law
    known = torquer.computer.blocks.law.as_law(given)
    memory = tuple(known.first_memory().tolist())
    assert answer == GivenLaw(name=known.name, parameters=known.values(), memory=memory)
    with pytest.raises(ValueError, match=r"^law .*: must be given again \(.*\): .* none$") as said:
        simulate(flown_scenario(result))
    assert "\n" not in str(said.value)
    with pytest.raises(ValueError, match="must be given again"):
        resume(simulate(make(), given, until_s=100.0))
    assert same(simulate(flown_scenario(result), given), result)
    assert same(resume(simulate(make(), given, until_s=100.0), given), result)


def test_a_law_of_a_script_is_given(make, file):
    """To load a script again would be to run it again."""
    names = {"__name__": "__main__"}
    exec(compile(LAWS, file, "exec"), names)
    assert flown_scenario(simulate(make(), names["tuned"])).control.law.kind == "given_in_python"


def test_the_text_of_a_law_outlives_its_file(make, tmp_path):
    file, padded = (
        tmp_path / "given_laws.py",
        LAWS + "#" * 200_000,
    )  # longer than a plain attribute of HDF5 may be
    file.write_text(padded)
    own = {"kind": "user", "file": str(file), "function": "tuned"}
    save(simulate(make({"control.law": own})), tmp_path / "result.nc")
    file.unlink()
    result = load(tmp_path / "result.nc")
    assert flown_laws(result)["law"]["text"] == padded
    with pytest.raises(
        ValueError, match=r"control\.law\.file: must be an existing file; received .*given_laws"
    ):
        simulate(flown_scenario(result))
    file.write_text(flown_laws(result)["law"]["text"])
    assert same(simulate(flown_scenario(result)), result)


def test_memory_in_a_scenario_must_fit_the_law(make, file):
    own = {"kind": "user", "file": str(file), "function": "tuned", "memory": [3.0, 1.0]}
    result = simulate(make({"control.law": own}))
    assert result.command_body.values[-1, 2] == pytest.approx(1e-3 * (1.0 + 3.0 * 600))
    with pytest.raises(ValueError, match=r"^control\.law\.memory: must have 2 cells, .*ed 1$"):
        simulate(make({"control.law": own | {"memory": [3.0]}}))
    with pytest.raises(ScenarioError, match=r"control\.law\.memory\[1\]: must be finite"):
        make({"control.law": own | {"memory": [0.0, float("nan")]}})


def test_summary_and_report_tell_the_law_that_was_flown(make, file, tmp_path):
    from torquer.report.flight.notes import notes
    from torquer.report.flight.page import page
    from torquer.report.flight.view import make_view
    from torquer.scenario.toml_text import to_toml

    result = simulate(make({"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}}),
                      of_the_file(file, "tuned", gain=3e5))  # fmt: skip
    assert torquer.summarise(result)["laws"]["law"]["name"] == "tuned"
    text = to_toml(json.loads(result.attrs["scenario"]))
    assert same(simulate(scenario_from_text(text)), result)
    view = make_view(result)
    assert not any("Python" in note for note in notes(view))
    assert '<h2>Law tuned</h2><pre tabindex="0">\nimport torquer\n' in page(view, ())
    view = make_view(simulate(make(), in_this_package))
    wanted = "the law in_this_package was passed from Python: to repeat the run it must be passed "
    assert f"{wanted}again" in notes(view)
    assert "given_in_python" in page(view, ())


def test_what_a_given_law_needs_is_checked(make):
    from torquer.computer.laws.unloading import Unloading

    with pytest.raises(ValueError, match=r"must be given for control\.law \(unloading\)"):
        simulate(make(), Unloading(kind="unloading", gain_per_s=1e-3).law())
    assert flown_scenario(simulate(make(), Off().law())).control.law == Off()


def test_a_given_law_in_a_file_is_one_line(plain_data):
    answer = {"kind": "given_in_python", "name": "mine"}
    scenario = scenario_from_data(plain_data({"control.law": answer}))
    with pytest.raises(ValueError, match="law mine: must be given again"):
        simulate(scenario)


def test_named_laws_do_not_silently_replace_an_only_law(make):
    scenario = make({"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}})
    with pytest.raises(ValueError, match=r"^laws: must be left out for a scenario with control"):
        simulate(scenario, laws={"a": Off().law()})
