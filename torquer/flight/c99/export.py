"""A scenario's on-board computer written as a folder of C99."""

import hashlib
import re
import struct
from collections.abc import Iterable
from pathlib import Path
from string import Template

from torquer.base.spec import check_spec
from torquer.base.version import VERSION
from torquer.computer.computer import parameter_places
from torquer.computer.gate import GATE_NOW, first_gate
from torquer.flight.c99.accessors import accessor_texts
from torquer.flight.c99.computer import (
    Export,
    OnBoard,
    find_computer,
    translate_step,
)
from torquer.flight.c99.ephemeris import OnBoardEphemeris, find_ephemeris, instants
from torquer.flight.c99.ephemeris_texts import ephemeris_files
from torquer.flight.c99.frameworks import FRAMEWORK_FILES, FRAMEWORKS, framework_texts
from torquer.flight.c99.in_the_loop import in_the_loop_text
from torquer.flight.c99.interface import (
    Input,
    contract_text,
    enums,
    input_copies,
    input_members,
    inputs_for,
    mode_names,
    outcome_enums,
    state_bytes,
)
from torquer.flight.c99.portable import PORTABLE
from torquer.flight.c99.precision import HELD, computing_in, is_held, is_single
from torquer.flight.c99.prefix import (
    DEFAULT,
    check_prefix,
    files_with_prefix,
    kept,
    named_with,
    with_prefix,
)
from torquer.flight.c99.print_c import INCLUDES, program_text, signature, types_text
from torquer.flight.c99.program import Program, translate_repeatedly
from torquer.flight.c99.readme import readme_text
from torquer.flight.c99.recording import record_steps, recorded_in_c
from torquer.flight.c99.records import make_record
from torquer.flight.c99.tables import constant_text, first_state, initialiser
from torquer.flight.c99.telemetry import called_entries, telemetry_texts, told_fields
from torquer.flight.c99.texts import PRECISION, fill_template, read_template, self_test
from torquer.flight.c99.trace import trace_table
from torquer.flight.c99.translation import Function
from torquer.flight.c99.types import REAL, Rows, Static
from torquer.scenario.spec import Scenario
from torquer.simulation.outside.library import find_prefix

#: What runs an export on an emulated processor, copied as it is.
_HARNESS = Path(__file__).parent / "harness"
_OF_HARNESS = (
    "pil.py", "stack.py", "differences.py", "misra.py", "coverage.py", "start.c", "target.ld",
)  # fmt: skip
_EPHEMERIS = ("adcs_ephemeris.c", "adcs_ephemeris.h")
#: The record as an array in C, and how many steps it has at most.
_IN_C, _ON_BOARD = "test/recorded.c", 40
#: What there is to say of a `while` of a user's.
ENDLESS = "`while` goes on until its condition is false; nothing else ends the step"
#: Control steps that the replay has unless others are asked for.
STEPS = 2000


def export_c(
    scenario: Scenario, folder: Path | str, steps: int = STEPS, real: str = "double",
    ephemeris: str | None = None, prefix: str = DEFAULT, framework: str | None = None,
) -> list[Path]:  # fmt: skip
    """Write the on-board computer of a scenario as C99 into a folder; returns the files.

    `steps`: control steps of a run from its start that are recorded for the replay in `test/`.
    `real`: "double", with the bits of the simulation, or "float" for processors that compute in
    single precision: times and what is kept in memory stay doubles.
    `ephemeris`: where the inputs from position to sunlight come from. None: they are handed in.
    "given": position and velocity are, the export works out field and Sun. "kepler", "sgp4": it
    works out all, by a Kepler orbit that drifts by J2 or by SGP4, from elements that the ground
    can send up.
    `prefix`: what the names of files, functions, types and macros begin with; two computers in one
    image have two.
    `framework`: "fprime", "cfs" or "freertos" writes a component, app or task around it as well.
    Raises a ValueError of one line for a kernel that cannot be translated (file, line, construct,
    what to write instead), and for an orbit or a field that the ephemeris cannot have.

        >>> files = torquer.export_c(scenario, "computer", steps=20)
        >>> "adcs.h" in {path.name for path in files}
        True
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise ValueError(f"steps: must be a whole number of 1 or more; received {steps!r}")
    if real not in ("double", "float"):
        raise ValueError(f"real: must be 'double' or 'float'; received {real!r}")
    check_prefix(prefix)
    here = find_prefix(Path(folder))
    if here not in (None, prefix):
        raise ValueError(f"prefix: must be that of the export in {folder}, {here!r}, or the folder "
                         f"another one; received {prefix!r}")  # fmt: skip
    if framework not in (None, *FRAMEWORKS):
        known = ", ".join(map(repr, FRAMEWORKS))
        raise ValueError(f"framework: must be one of {known} or None; received {framework!r}")
    computer = find_computer(check_spec(scenario))
    own = None if ephemeris is None else find_ephemeris(computer.scenario, ephemeris)
    with computing_in(real), named_with(prefix):
        _check_parameters(computer)
        made = translate_step(computer)
        inputs = inputs_for(computer, made, own is not None)
        record = record_steps(computer.scenario, steps, made, inputs)
        texts = _texts(computer, made, len(record.marks), own)
        files: dict[str, str | bytes] = {**texts}
        if framework is not None:
            files |= framework_texts(computer, framework, inputs, own is not None)
        files["test/recorded.bin"] = record.as_bytes() + (_instants(own) if own else b"")
        if not is_single():
            few = record.first(_ON_BOARD)
            files[_IN_C] = recorded_in_c(few.as_bytes() + (_instants(own, 5) if own else b""))
        seldom = {*_EPHEMERIS, _IN_C, *FRAMEWORK_FILES}
        left = with_prefix(" ".join(seldom - set(files))).split()
        files = files_with_prefix(files)
    for each in left:  # of an export that was here before
        (Path(folder) / each).unlink(missing_ok=True)
    return [_write(Path(folder) / name, content) for name, content in files.items()]


def _instants(ephemeris: OnBoardEphemeris, most: int | None = None) -> bytes:
    """How many instants the replay has of the ephemeris, at `most` so many, and their rows."""
    rows = instants(ephemeris)[:most]
    return struct.pack("<Q", len(rows)) + rows.astype("<f8").tobytes()


def _check_parameters(computer: OnBoard) -> None:
    """ValueError of one line for a parameter that single precision does not hold."""
    for name, (first, count) in parameter_places(computer.blocks).items() if is_single() else ():
        for value in computer.board.parameters[first : first + count].tolist():
            if not is_held(value):
                raise ValueError(
                    f"real: must be 'double' unless all parameters are {HELD}; "
                    f"received {value:g} in {name}"
                )


def by_file(places: Iterable[tuple[str, int, str]]) -> list[str]:
    """Places in users' kernels, a text for each file."""
    lines: dict[str, list[int]] = {}
    for file, line, _ in places:
        lines.setdefault(Path(file).name, []).append(line)
    return [
        f"{name}, line{'s' * (len(set(of)) > 1)} {', '.join(map(str, sorted(set(of))))}"
        for name, of in lines.items()
    ]


def _write(file: Path, content: str | bytes) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def make_texts(
    computer: OnBoard, made: Export, steps: int, ephemeris: OnBoardEphemeris | None = None
) -> dict[str, str]:
    """All texts of an export by the names of their files."""
    return files_with_prefix(_texts(computer, made, steps, ephemeris))


def _texts(
    computer: OnBoard, made: Export, steps: int, ephemeris: OnBoardEphemeris | None
) -> dict[str, str]:
    """These texts before they have their prefix."""
    name = kept(computer.scenario.name.replace("*/", "* /"))
    program, general = made.program, {"name": name, "version": VERSION}
    constants = program.type_name(made.computer)
    given = inputs_for(computer, made, ephemeris is not None)
    places = {"computer": constants, "includes": INCLUDES, "types": _types(made, given)}
    places |= self_test(("double",))
    inputs = {
        "enums": enums(computer),
        "inputs": input_members(given),
        **outcome_enums(),
        "contract": contract_text(computer),
        "telemetry": telemetry_texts(computer, made, given)["members"],
    }
    texts = {
        "adcs.h": _header(computer, made, general | inputs | _precision_text()),
        "adcs_types.h": fill_template("adcs_types.h", general | places),
        "adcs.c": fill_template(
            "adcs.c",
            general
            | _source_text(computer, made, given)
            | _precision_text()
            | _of_ephemeris(ephemeris is not None),
        ),
        "adcs_tables.c": fill_template("adcs_tables.c", general | _tables_text(computer, made)),
        "CMakeLists.txt": _cmake(ephemeris is not None),
        "adcs.pc.in": read_template("adcs.pc.in"),
        "README.md": readme_text(
            computer,
            name,
            steps,
            told_fields(computer, made, given),
            ephemeris,
            [*by_file(program.checks), *(f"{each}: {ENDLESS}" for each in by_file(program.loops))],
            given,
            state_bytes(computer, made),
        ),
        "test/in_the_loop.c": in_the_loop_text(
            name, computer.board, made, given, _fresh_gate(program), len(computer.blocks.laws)
        ),
        "test/replay.c": _replay(ephemeris is not None),
        **{each: (_HARNESS / each).read_text() for each in ("Makefile", "MISRA.md")},
        **_portable(),
        **(ephemeris_files(ephemeris, name) if ephemeris else {}),
        **{f"test/{each}": (_HARNESS / each).read_text() for each in _OF_HARNESS},
    }
    sources = {each: text for each, text in texts.items() if re.fullmatch(r"adcs\w*\.c", each)}
    return texts | {"TRACE.csv": trace_table(sources)}


def _header(computer: OnBoard, made: Export, places: dict[str, str]) -> str:
    """The public header, which states a mark of itself and one of what a state is."""
    size = state_bytes(computer, made)
    places |= {
        "state_bytes": str(size),
        "state_version": f"0x{_mark(f'{computer.fingerprint} {is_single()} {size}', 16)}",
    }
    text = fill_template("adcs.h", places | {"interface": "0"})
    return fill_template("adcs.h", places | {"interface": f"0x{_mark(text, 8)}"})


def _mark(text: str, digits: int) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:digits]


def _types(made: Export, inputs: list[Input]) -> str:
    """The structs that the texts of an export name."""
    roots = (made.computer, made.gate, made.state, *made.entries["gated_step"].arguments[-1][1:])
    named = [made.program.type_name(each) for each in roots]
    text = program_text(made.program, False, called_entries(made, inputs))
    return types_text(made.program, used=" ".join((*named, text)))


def _fresh_gate(program: Program) -> str:
    """The gate before its first step, as a constant of C."""
    kind = Rows(make_record("GateNow", GATE_NOW), 1)
    numbers = initialiser(program, first_gate(), kind)
    return f"static const {program.type_name(kind)} fresh[1] = {numbers};\n"


def _portable() -> dict[str, str]:
    """Functions of angles with the same bits everywhere; see `torquer.flight.c99.portable`."""

    def build(program):
        for kernel in PORTABLE.values():
            types = [REAL] * kernel.__code__.co_argcount
            program.function(kernel, types).is_public = True

    with computing_in("double"):
        return _portable_texts(translate_repeatedly(build, prefix="math_"))


def _portable_texts(program: Program) -> dict[str, str]:
    public = [each for each in program.functions.values() if each.is_public]
    prototypes = "".join(f"{signature(program, each)};\n" for each in public)
    places = {"version": VERSION, "includes": INCLUDES, "program": program_text(program)}
    places |= self_test(("double",))
    texts = {
        "adcs_math.h": fill_template("adcs_math.h", {"prototypes": prototypes}),
        "adcs_math.c": fill_template("adcs_math.c", places),
    }
    return {file: re.sub(r"\b(?=portable_)", "adcs_", text) for file, text in texts.items()}


def _precision_text() -> dict[str, str]:
    """What differs between an export in double and in single precision."""
    if not is_single():
        return {"precision": "", "to_double": "", "to_real": ""} | self_test(("double",))
    casts = {"to_double": "(double)", "to_real": "(float)"}
    return {"precision": PRECISION, **casts} | self_test(("double", "float"))


def _of_ephemeris(has_ephemeris: bool) -> dict[str, str]:
    """How the self-test asks the ephemeris on board, if there is one."""
    if not has_ephemeris:
        return {"include_ephemeris": "", "is_ephemeris_exact": ""}
    return {
        "include_ephemeris": f'#include "{_EPHEMERIS[1]}"\n',
        "is_ephemeris_exact": " && adcs_ephemeris_is_exact()",
    }


#: What the interface hands to the kernels that it calls, by the names of their arguments.
_HANDED = {
    "gate": "adcs_gate()", "computer": "adcs_constants()", "board": "&own->board",
    "gate_now": "own->gate", "inputs": "&given", "value": "${to_real}value",
}  # fmt: skip


def _source_text(computer: OnBoard, made: Export, inputs: list[Input]) -> dict[str, str]:
    return {
        "program": program_text(made.program, False, called_entries(made, inputs)),
        "telemetry": telemetry_texts(computer, made, inputs)["fill"],
        "copies": input_copies(inputs, made),
        **{f"call_{name}": _call(each) for name, each in made.entries.items()},
        **accessor_texts(computer, made),
    }  # fmt: skip


def _call(entry: Function) -> str:
    """A call of a kernel with what the function of the interface around it has."""
    to_real = {"to_real": "(float)" if is_single() else ""}
    handed = [
        Template(_HANDED.get(name, name)).substitute(to_real)
        for name, kind in entry.arguments
        if name not in entry.unused and not isinstance(kind, Static)
    ]
    handed += ["&own->board.failures"] * entry.reports
    return f"{entry.name}({', '.join(handed)})"


def _tables_text(computer: OnBoard, made: Export) -> dict[str, str]:
    program = made.program
    return {
        "computer": program.type_name(made.computer),
        "constants": constant_text(program, made.computer, "constants", computer.computer),
        "gate": constant_text(program, made.gate, "gate", made.checks),
        "first": initialiser(
            program,
            {"board": first_state(computer.board), "gate": first_gate()},
            made.state,
        ),
        "mode_names": mode_names(computer),
        "fingerprint": computer.fingerprint + " float" * is_single(),
    }


def _cmake(has_ephemeris: bool) -> str:
    """The file of CMake; in single precision a replay has no recorded bits to compare with."""
    text = read_template("CMakeLists.txt").replace("VERSION 0.0.0", f"VERSION {_cmake_version()}")
    if is_single():
        text = text.replace("test/recorded.bin)", "test/recorded.bin answers.bin)")
        text = text.partition("\n# without a file")[0] + "\n"
    if has_ephemeris:
        source, header = _EPHEMERIS
        text = text.replace("add_library(adcs adcs.c", f"add_library(adcs adcs.c {source}")
        text = text.replace("SHARED adcs_tables.c", f"SHARED adcs_tables.c {source}")
        text = text.replace("install(FILES adcs.h", f"install(FILES adcs.h {header}")
    return text


def _cmake_version() -> str:
    """The version of torquer by its numbers alone."""
    return ".".join(re.findall(r"\d+", VERSION)[:3])


def _replay(has_ephemeris: bool) -> str:
    """The replay, also of the ephemeris on board if there is one."""
    text = (_HARNESS / "replay.c").read_text()
    header = "adcs_ephemeris.h" if has_ephemeris else "adcs.h"
    return text.replace('#include "adcs.h"', f'#include "{header}"')
