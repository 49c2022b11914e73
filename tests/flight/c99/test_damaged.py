"""States that were never begun, or that are damaged: every function of an export answers."""

import re
import subprocess
from pathlib import Path

import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import EXAMPLES, STRICT
from flight.c99.test_spoiled import SANITIZED
from flight.c99.test_user_laws import scenario_of

import torquer
from torquer.flight.c99.texts import without_comments

#: Values of arguments by their types in C.
VALUES = {
    "int32_t": ("0", "1", "2", "-1", "INT32_MIN", "INT32_MAX"),
    "bool": ("true",), "double": ("0.0", "1.0", "(double)NAN", "1e300"),
}  # fmt: skip
#: What does not go by the state that it is given: it begins it, seals it, or takes a step.
APART = {"init", "seal_state", "step"}


def functions(header: str, prefix: str) -> list[tuple[str, str, list[str]]]:
    """Answer, name and types of the arguments but the first of each function of a state."""
    text = without_comments(header)
    pattern = rf"^(\w+) {prefix}_(\w+)\((const )?{prefix}_state \*state(?:, ([^)]*))?\);"
    return [
        (answer, name, re.findall(r"(?:^|, )((?:const )?\w+ \*?)\w+", " ".join(rest.split())))
        for answer, name, _, rest in re.findall(pattern, text, flags=re.M)
        if name not in APART
    ]


def calls(header: str, prefix: str) -> str:
    """`look` and `set` of `damaged.c`."""
    look, setters = "", ""
    for answer, name, kinds in functions(header, prefix):
        kinds = [each.strip() for each in kinds]
        for value in range(max(len(VALUES.get(kind, "1")) for kind in [*kinds, "bool"])):
            given = [_argument(kind, value, prefix) for kind in kinds]
            call = f"{prefix}_{name}({', '.join(['state', *given])})"
            if answer == f"{prefix}_outcome":
                said = f"{prefix.upper()}_NOT_BEGUN"
                setters += f"    outcome = {call};\n    if (expected == {said} && "
                setters += f'outcome != expected) {{\n        return "{name}";\n    }}\n'
            else:
                look += f"    (void){call};\n"
    return (
        f"static void look(const {prefix}_state *state, const {prefix}_inputs *inputs,\n"
        f"    const {prefix}_command *command)\n{{\n    {prefix}_report report;\n"
        f"    int64_t line = 0;\n{look}    (void)report;\n}}\n\n"
        f"static const char *set({prefix}_state *state, {prefix}_outcome expected)\n{{\n"
        f"    {prefix}_outcome outcome;\n{setters}    return NULL;\n}}\n"
    )


def _argument(kind: str, value: int, prefix: str) -> str:
    pointers = {
        "int64_t *": "&line", f"const {prefix}_inputs *": "inputs",
        f"const {prefix}_command *": "command", f"{prefix}_report *": "&report",
    }  # fmt: skip
    return pointers.get(kind) or VALUES[kind][value % len(VALUES[kind])]


def damaged(scenario: torquer.Scenario, cases: int, folder: Path, prefix: str = "adcs"):
    """An export under sanitizers whose state is damaged in so many cases."""
    torquer.export_c(scenario, folder, steps=60, prefix=prefix)
    own = folder / "damaged.c"
    text = Path(__file__).with_name("damaged.c").read_text()
    own.write_text(re.sub(r"\badcs(?=[_.])", prefix, text).replace("ADCS_", f"{prefix.upper()}_"))
    made = calls((folder / f"{prefix}.h").read_text(), prefix)
    (folder / "calls.h").write_text(f"#include <math.h>\n#include <stddef.h>\n{made}")
    sources = [own, folder / f"{prefix}.c", folder / f"{prefix}_tables.c"]
    options = ["-D_POSIX_C_SOURCE=200809L", "-O1", *SANITIZED, f"-I{folder}"]
    command = [COMPILER, *FLAGS, *STRICT, *options, *sources, "-o", folder / "damaged", "-lm"]
    subprocess.run(command, check=True)
    command = [folder / "damaged", folder / "test/recorded.bin", str(cases)]
    return subprocess.run(command, capture_output=True, text=True)


LAW = """
import torquer

@torquer.law(memory={"count": 0.0, "kept": [0.0] * 5}, parameters={"gain": 1e4})
def counted(inputs, parameters, memory):
    place = int(memory.count)
    memory.kept[place] = parameters.gain * inputs.b_body_t[0]
    memory.count = float((place + 1) % 5)
    return (memory.kept[int(memory.count)], 0.0, 0.0)
"""


@needs_compiler
def test_a_users_law_answers_whatever_its_state_holds(tmp_path):
    done = damaged(scenario_of(("counted",), tmp_path, LAW), 3000, tmp_path / "c")
    assert (done.returncode, done.stdout, done.stderr) == (0, "3000 damaged states\n", "")


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "prefix"),
    [("turn_to_the_sun", "wheels"), ("chibis_m_flight", "adcs"), ("several_sensors", "adcs"),
     ("magneto_gyro_micro", "nav"), ("spinner_modes", "adcs"), ("safe_mode", "adcs")],
)  # fmt: skip
def test_every_function_answers_whatever_a_state_holds(name, prefix, tmp_path):
    scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
    done = damaged(scenario, 5000, tmp_path, prefix)
    assert (done.returncode, done.stdout, done.stderr) == (0, "5000 damaged states\n", "")


@needs_compiler
def test_functions_of_a_state_are_found_by_the_header(tmp_path):
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    torquer.export_c(scenario, tmp_path, steps=1)
    text = (tmp_path / "adcs.h").read_text()
    found = functions(text, "adcs")
    takers = set(re.findall(r"\badcs_(\w+)\((?:const )?adcs_state \*", without_comments(text)))
    assert {name for _, name, _ in found} == takers - APART
    assert {name for answer, name, _ in found if answer == "adcs_outcome"} == {
        "rebase", "restart_estimators", "command_mode", "hold", "set_flag", "set_parameter",
    }  # fmt: skip
