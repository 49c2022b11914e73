"""What carries an export in F Prime, cFS and FreeRTOS: it builds, and flies with the same bits.

The headers are stubs, called so. Real ones are tried where the variables `FPRIME_INCLUDE`,
`CFE_INCLUDE` or `FREERTOS_INCLUDE` list their folders, and the model of the component where `fpp`
is installed (`pip install fprime-fpp`).
"""

import functools
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from flight.c99.frameworks.stub_fprime import stub_base
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler

import torquer
from torquer.compile.c_library import EXACT
from torquer.computer.blocks.limits import FREE
from torquer.flight.c99.computer import OnBoard, find_computer, translate_step
from torquer.flight.c99.frameworks import FRAMEWORK_FILES, FRAMEWORKS, framework_texts
from torquer.flight.c99.frameworks.declared import declare
from torquer.flight.c99.interface import Input, inputs_for
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.timetable import COILS_OFF, COILS_ON, CONTROL, make_timetable

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[3] / "examples"
#: One without modes, one with measurement windows; the slow ones have modes.
NAMES = ["my_law", "tip_off_campaign"]
SLOW = ["safe_mode", "which_sensors"]
STRICT = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wdouble-promotion"]
IN_CPP = ["-std=c++14", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wconversion"]
CPP = shutil.which("g++")
needs_cpp = pytest.mark.skipif(CPP is None, reason="no compiler of C++")
FPP_CHECK, FPP_TO_CPP = shutil.which("fpp-check"), shutil.which("fpp-to-cpp")
_LIBRARY = ("adcs.c", "adcs_cycle.c", "adcs_tables.c")


def scenario(name: str) -> Scenario:
    return torquer.load_scenario(EXAMPLES / f"{name}.toml")


@functools.cache
def parts_of(name: str) -> tuple[OnBoard, list[Input]]:
    """The computer of an example, and what is handed in to it."""
    computer = find_computer(scenario(name))
    return computer, inputs_for(computer, translate_step(computer))


def ran(*command) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def written(texts: dict[str, str], folder: Path) -> None:
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def real_headers(variable: str) -> list[str]:
    """Folders of a framework's own headers."""
    if variable not in os.environ:
        pytest.skip(f"{variable} is not set")
    return [f"-I{each}" for each in os.environ[variable].split(os.pathsep)]


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A function that exports an example with the files of all frameworks."""
    folders: dict[str, Path] = {}

    def export(name: str) -> Path:
        if name not in folders:
            folders[name] = tmp_path_factory.mktemp(name)
            torquer.export_c(scenario(name), folders[name], steps=200, framework="cfs")
            computer, inputs = parts_of(name)
            for framework in FRAMEWORKS:
                written(framework_texts(computer, framework, inputs), folders[name])
        return folders[name]

    return export


@needs_compiler
def test_every_build_bars_what_would_change_bits(exported):
    """What builds an export, and what is said where another build is met."""
    folder = exported("tip_off_campaign")
    builds = [*folder.rglob("CMakeLists.txt")]
    assert len(builds) == 1 + len(FRAMEWORKS)
    said = [
        folder / "README.md",
        folder / "test/replay.c",
        *folder.glob("cfs/*/fsw/src/adcs_app.c"),
    ]
    assert len(said) == 3
    for file in (*builds, *said):
        assert all(flag in file.read_text() for flag in EXACT), file


def objects(folder: Path) -> list[Path]:
    """The library with the cycle around it, compiled."""
    made = []
    for name in _LIBRARY:
        made.append(folder / f"{name}.o")
        if not made[-1].exists():
            flags = [*FLAGS, *STRICT, f"-I{folder}", "-c"]
            ran(COMPILER, *flags, "-o", made[-1], folder / name)
    return made


def sources_of(framework: str, folder: Path) -> tuple[list[Path], list[str]]:
    """Files of C of a framework, and the folders of their headers."""
    if framework == "cfs":
        app = folder / "cfs/adcs_app"
        files = [*sorted(app.glob("fsw/*/*.c"))]
        return files, [f"-I{app}/fsw/inc", f"-I{app}/fsw/src", f"-I{folder}"]
    return [folder / "freertos/adcs_task.c"], [f"-I{folder}/freertos", f"-I{folder}"]


def flown_in_c(framework: str, folder: Path) -> str:
    files, headers = sources_of(framework, folder)
    headers = [*headers, f"-I{HERE}/stub_{framework}", f"-I{HERE}"]
    program = folder / f"fly_{framework}"
    flown = [*files, HERE / f"fly_{framework}.c", *objects(folder)]
    ran(COMPILER, *FLAGS, *STRICT, *headers, "-o", program, *flown, "-lm")
    return ran(program, folder / "test/recorded.bin")


def flown_in_fprime(name: str, folder: Path) -> str:
    component, stub = folder / "fprime/Controller", folder / "stub"
    stub.mkdir(exist_ok=True)
    model = (component / "Controller.fpp").read_text()
    (stub / "ControllerComponentAc.hpp").write_text(stub_base(model))
    written(parts_of_harness(name), stub)
    headers = [f"-I{each}" for each in (folder, component, stub, HERE / "stub_fprime", HERE)]
    flown = [component / "Controller.cpp", HERE / "fly_fprime.cpp", *objects(folder)]
    ran(CPP, *IN_CPP, *headers, "-o", folder / "fly_fprime", *flown, "-lm")
    return ran(folder / "fly_fprime", folder / "test/recorded.bin")


def parts_of_harness(name: str) -> dict[str, str]:
    """What the harness of F Prime hands in, and which parameter and mode it sets."""
    declared = declare(*parts_of(name))
    copies = [
        f"inputs.get_{each.name}()[{k}] = given.{each.name}[{k}];"
        if each.count > 1
        else f"inputs.set_{each.name}(given.{each.name}{'[0]' * each.is_array});"
        for each in declared.inputs
        for k in range(each.count)
    ]
    sets = ["component->source = hand_in;"]
    single = [each for each in declared.parameters if each.is_settable and len(each.values) == 1]
    for each in single[:1]:
        sets += [
            "component->validity = Fw::ParamValid::VALID;",
            f"component->prm_{each.name} = {1.5 * each.values[0] + 0.25!r};",
            f"component->callParameterUpdated(Adcs::Controller::PARAMID_{each.name});",
            "component->sent.events.clear();",
            "component->tick();",
            'good = good && component->sent.events.at(0) == "ParameterSet";',
            f"component->prm_{each.name} = static_cast<double>(NAN);",
            f"component->callParameterUpdated(Adcs::Controller::PARAMID_{each.name});",
            "component->sent.events.clear();",
            "component->tick();",
            'good = good && component->sent.events.at(0) == "ParameterRefused";',
        ]
    for region in declared.regions[:1]:
        kind, last = f"Mode_{region.itself.name.removeprefix('REGION_')}", region.states[-1]
        sets += [
            f"component->send_HOLD(Adcs::Region::{region.itself.name}, true);",
            f"component->send_SET_{kind.upper()}(Adcs::{kind}::{last.name});",
            "good = good && component->sent.responses.back() == Fw::CmdResponse::OK;",
            "run_to_step(*component);",
            f'good = good && component->sent.channels["{kind}"].at(0) == {last.number};',
            f'good = good && component->sent.channels["HELD_{region.itself.name}"].at(0) == 1.0;',
        ]
    return {
        "inputs_to_component.inc": "\n".join(copies) + "\n",
        "sets_parameter.inc": "\n".join(sets) + "\n",
    }


@needs_compiler
@pytest.mark.parametrize("framework", ["cfs", "freertos"])
@pytest.mark.parametrize("name", [*NAMES, *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)])
def test_app_and_task_have_the_bits_of_the_library(exported, name, framework):
    assert "200 of 200 steps: the same bits" in flown_in_c(framework, exported(name))


@needs_compiler
@needs_cpp
@pytest.mark.parametrize("name", [*NAMES, *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)])
def test_component_has_the_bits_of_the_library(exported, name):
    assert "200 of 200 steps: the same bits" in flown_in_fprime(name, exported(name))


_TICKS = """\
#include "adcs_cycle.h"
#include <stdio.h>
int main(void)
{
    static adcs_cycle cycle;
    for (adcs_cycle_begin(&cycle); ; adcs_cycle_tick(&cycle)) {
        const bool opens = adcs_cycle_opens_window(&cycle);
        if (adcs_cycle_is_due(&cycle)) {
            printf("%d %d\\n", (int)cycle.tick, (int)opens);
        }
        if (cycle.tick == ADCS_CYCLE_TICKS - 1) {
            return 0;
        }
    }
}
"""


def with_windows(**control) -> Scenario:
    craft = scenario("my_law")
    return craft.model_copy(update={"control": craft.control.model_copy(update=control)})


@needs_compiler
@pytest.mark.parametrize(
    "control",
    [
        {},
        {"sample_s": 0.5, "measure_s": 2.0, "actuate_s": 3.0},
        {"sample_s": 1.0, "measure_s": 2.0, "actuate_s": 4.0, "control_while_actuating": True},
        {"sample_s": 2.0, "measure_s": 2.0, "actuate_s": 5.0},
    ],
    ids=["plain", "windows", "while acting", "one step"],
)
def test_control_steps_are_due_when_the_simulation_takes_them(exported, tmp_path, control):
    craft, folder = with_windows(**control), exported("my_law")
    written(framework_texts(find_computer(craft), "freertos", []), tmp_path)
    (tmp_path / "ticks.c").write_text(_TICKS)
    files = [tmp_path / "ticks.c", tmp_path / "adcs_cycle.c", folder / "adcs.c"]
    headers = [f"-I{tmp_path}", f"-I{folder}", "-o", tmp_path / "ticks"]
    ran(COMPILER, *FLAGS, *headers, *files, folder / "adcs_tables.c", "-lm")
    due = [tuple(map(int, line.split())) for line in ran(tmp_path / "ticks").splitlines()]
    times, step_s = declare(find_computer(craft), []).schedule, craft.grid_s
    assert times.tick_ns == pytest.approx(1e9 * craft.control.cycle_s / times.cycle, abs=0.5)
    in_steps = round(times.tick_ns * 1e-9 / step_s)
    parts = [craft.control.cycle_s, craft.control.measure_s, craft.control.sample_s]
    cycle, measure, sample = (round(each / step_s) for each in parts)
    table = make_timetable(cycle, measure, sample, {}, craft.control.control_while_actuating)
    rows = [(int(row["step"]), int(row["actions"])) for row in table.rows]
    assert [(tick * in_steps, opens) for tick, opens in due] == [
        (step, int(actions & COILS_OFF > 0)) for step, actions in rows if actions & CONTROL
    ]
    on = [step for step, actions in rows if actions & COILS_ON]
    assert on == [times.measure * in_steps]


def test_a_table_of_cfs_and_a_model_of_fprime_know_the_limits_of_parameters():
    computer, inputs = parts_of("tip_off_campaign")
    own = [each for each in declare(computer, inputs).parameters if each.limits != [FREE]]
    assert own and all(each.is_settable for each in own)
    app = framework_texts(computer, "cfs", inputs)["cfs/adcs_app/fsw/src/adcs_app.c"]
    model = framework_texts(computer, "fprime", inputs)["fprime/Controller/Controller.fpp"]
    for each in own:
        (limits,) = each.limits
        assert f"AreRight && isfinite(Table->{each.name}) && Table->{each.name} >= " in app
        assert f"Table->{each.name} <= {limits.greatest!r};" in app
        assert f"@ {each.said}\n    param {each.name}: " in model and str(limits) in each.said
    assert "OUT_OF_RANGE = 5" in model


@pytest.mark.skipif(FPP_CHECK is None, reason="fpp is not installed")
@pytest.mark.parametrize("name", ["my_law", "safe_mode", "which_sensors"])
def test_model_is_one_for_fpp(tmp_path, name):
    computer, inputs = parts_of(name)
    written(framework_texts(computer, "fprime", inputs), tmp_path)
    model = tmp_path / "fprime/Controller/Controller.fpp"
    ran(FPP_CHECK, HERE / "stub_fprime/framework.fpp", model)


@pytest.mark.skipif(FPP_TO_CPP is None, reason="fpp is not installed")
def test_stub_has_the_signatures_that_fpp_generates(tmp_path):
    computer, inputs = parts_of("safe_mode")
    written(framework_texts(computer, "fprime", inputs), tmp_path)
    model = tmp_path / "fprime/Controller/Controller.fpp"
    ran(FPP_TO_CPP, "-d", tmp_path, "-i", HERE / "stub_fprime/framework.fpp", model)
    theirs = functions((tmp_path / "ControllerComponentAc.hpp").read_text())
    ours = functions(stub_base(model.read_text()))
    named = re.compile(
        r"(log|tlmWrite|paramGet|cmdResponse|inputsGet|actuate)_|\w+_(cmdH|h)andler$"
    )
    checked = [name for name in ours if named.match(name)]
    assert len(checked) > 50
    assert {name: ours[name] for name in checked} == {name: theirs.get(name) for name in checked}


def functions(header: str) -> dict[str, list[str]]:
    """Types of the arguments of each function of a header, by its name."""
    text = re.sub(r"//[^\n]*", "", header).replace("Adcs::", "")
    found = {}
    for name, arguments in re.findall(
        r"(?<!->)\b(\w+)\(([^(){};]*(?:\(\)[^(){};]*)?)\)\s*(?:const)?", text
    ):
        kinds = [kind_of(each) for each in arguments.split(",") if "_tlmTime" not in each]
        found.setdefault(name, [each for each in kinds if each])
    return found


def kind_of(argument: str) -> str:
    """The type in an argument, its name left out."""
    words = argument.split("=")[0].replace("&", " & ").split()
    is_named = len(words) > 1 and words[-1] not in ("&", "const") and words[0] != words[-1]
    is_type = len(words) == 2 and words[0] == "const"
    return " ".join(words[:-1] if is_named and not is_type else words)


@needs_compiler
@pytest.mark.parametrize(("framework", "variable"), [("cfs", "CFE"), ("freertos", "FREERTOS")])
def test_it_compiles_with_the_real_headers(exported, framework, variable):
    real = real_headers(f"{variable}_INCLUDE")
    files, headers = sources_of(framework, exported("my_law"))
    ran(COMPILER, "-std=c99", "-fsyntax-only", "-Wall", "-Wextra", *headers, *real, *files)


@needs_cpp
def test_component_compiles_with_the_real_headers(exported):
    real, folder = real_headers("FPRIME_INCLUDE"), exported("my_law")
    component = folder / "fprime/Controller"
    headers = [f"-I{folder}", f"-I{component}", *real]
    ran(CPP, "-std=c++14", "-fsyntax-only", *headers, component / "Controller.cpp")


@pytest.mark.parametrize("wrong", ["zephyr", "", 1])
def test_an_unknown_framework_is_refused(tmp_path, wrong):
    with pytest.raises(ValueError, match=r"^framework: must be one of 'fprime', 'cfs', 'freertos'"):
        torquer.export_c(scenario("my_law"), tmp_path, framework=wrong)
    assert not list(tmp_path.iterdir())


def test_an_export_for_another_framework_leaves_no_files_of_the_one_before(tmp_path):
    torquer.export_c(scenario("my_law"), tmp_path, steps=1, framework="freertos")
    assert (tmp_path / "freertos/adcs_task.c").exists()
    torquer.export_c(scenario("my_law"), tmp_path, steps=1, framework="fprime")
    left = {each for each in FRAMEWORK_FILES if (tmp_path / each).exists()}
    assert left == set(framework_texts(find_computer(scenario("my_law")), "fprime", []))


def test_an_ephemeris_on_board_is_built_with_it():
    computer = find_computer(scenario("my_law"))
    for framework in FRAMEWORKS:
        for has in (False, True):
            texts = framework_texts(computer, framework, [], has)
            build = "".join(text for name, text in texts.items() if name.endswith("Lists.txt"))
            assert ("adcs_ephemeris.c" in build) == has
