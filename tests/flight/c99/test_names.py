"""Laws whose functions, tuples and parameters are named as the text around them in C is."""

import re
import subprocess
from pathlib import Path

from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import STRICT, built, replayed
from flight.c99.test_user_laws import scenario_of

import torquer
from torquer.flight.c99.words import AROUND

FUNCTIONS = (
    "adcs_step", "adcs_init", "adcs_met", "is_region", "are_words_in_order", "are_doubles_exact",
    "gated_step", "set_flag", "mark_of", "ADCS_DONE", "ADCS_CONTROL_PERIOD_S", "failures",
)  # fmt: skip
TUPLES = (
    "adcs_outcome", "adcs_command", "adcs_estimate", "Known", "Answer", "Gate", "Board", "Computer",
    "constants", "gate", "first", "fresh", "lengths", "head_of_file", "ADCS_MEASURE_S",
)  # fmt: skip
LAWS = f"""
from typing import NamedTuple
import numba
import torquer

{
    "".join(
        f'''
@numba.njit
def {name}(x, gain):
    return x * gain - {k}.0

'''
        for k, name in enumerate(FUNCTIONS)
    )
}
{
    "".join(
        f'''
class {name}(NamedTuple):
    x: float
    ADCS_CONTROL_PERIOD_S: float

@numba.njit
def made_{k}(x, gain):
    return {name}(x, gain)

'''
        for k, name in enumerate(TUPLES)
    )
}
@torquer.law(parameters={{"ADCS_CONTROL_PERIOD_S": 1e-9}}, memory={{"ADCS_MEASURE_S": 0.0}})
def adcs_state(inputs, parameters, memory):
    gain = parameters.ADCS_CONTROL_PERIOD_S
    ADCS_H = inputs.b_body_t[0]
    {"".join(f"ADCS_H += {name}(ADCS_H, gain){chr(10)}    " for name in FUNCTIONS)}
    {"".join(f"t{k} = made_{k}(ADCS_H, gain){chr(10)}    " for k in range(len(TUPLES)))}
    ADCS_H += {" + ".join(f"t{k}.x * t{k}.ADCS_CONTROL_PERIOD_S" for k in range(len(TUPLES)))}
    memory.ADCS_MEASURE_S += ADCS_H
    return (1e-4 * ADCS_H, 0.0, 0.0)


@torquer.law(parameters={{"gain": 1.0}})
def adcs_inputs(inputs, parameters, memory):
    return (parameters.gain * inputs.b_body_t[0], 0.0, 0.0)
"""


@needs_compiler
def test_names_of_the_interface_are_kept_from_a_users_law(tmp_path):
    folder = tmp_path / "c"
    torquer.export_c(scenario_of(("adcs_state", "adcs_inputs"), tmp_path, LAWS), folder, steps=20)
    done = replayed(built(folder), folder)
    assert done.stdout == "20 control steps: the same bits in commands and state\n"
    loop = [COMPILER, *FLAGS, *STRICT, "-fsyntax-only", f"-I{folder}", "test/in_the_loop.c"]
    subprocess.run(loop, check=True, cwd=folder)
    text = (folder / "adcs.c").read_text()
    assert all(re.search(rf"\b(own_)?{name}(_2)?\(", text) for name in FUNCTIONS)


def test_all_names_of_the_header_are_kept():
    """Its functions and its types."""
    header = (Path(torquer.__file__).parent / "flight/c99/templates/adcs.h").read_text()
    named = set(re.findall(r"\b(adcs_[a-z_]+)\(|^\} (adcs_[a-z_]+);", header, flags=re.M))
    names = {each for pair in named for each in pair if each}
    assert len(names) > 15 and names <= AROUND
