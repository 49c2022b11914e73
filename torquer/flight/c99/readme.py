"""The README of an export: what differs between double and single precision, inputs, constants."""

from collections.abc import Sequence

from torquer.base.version import VERSION
from torquer.computer.gate import MET, OUTCOMES
from torquer.flight.c99.computer import OnBoard
from torquer.flight.c99.ephemeris import OnBoardEphemeris
from torquer.flight.c99.ephemeris_texts import ephemeris_readme
from torquer.flight.c99.interface import Input, c_constant, contract, named_constants
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.prefix import kept
from torquer.flight.c99.telemetry import Told, left_out
from torquer.flight.c99.texts import fill_template

#: What the README says of the bits of an export in double and in single precision.
_BITS = """\
with the bits
that they have in the simulation.

It needs functions of the C library. `sqrt`, `floor`, `fmod` and `copysign` have the same bits in
all. `sin`, `cos`, `asin`, `acos`, `atan`, `atan2` differ in the last bit from library to library:
with `ADCS_PORTABLE` defined the build takes those of `adcs_math.c`, which round correctly.

| build | has the bits of |
|---|---|
| with the library of the simulation | the simulation: `test/replay.c` compares them |
| `ADCS_PORTABLE`, for whatever target | every other such build, not always of the simulation |

`exp`, `pow`, `log` and others are the library's in both.
"""
_BITS_IN_SINGLE = """\
in single
precision. Its bits are not those of the simulation, which computes in doubles.

Times are doubles, and so are interface and memory: a float would resolve 8 ms of a time after a
day. What lies between two times, and all else, is computed in floats; parameters are floats.
Functions of the C library are those for doubles, rounded to floats, but for `sqrtf`, `fabsf`,
`fmodf`, `floorf` and their like, which round correctly. So the last bit of a double, in which
libraries differ, changes an answer only at the middle between two floats, about once in 10^8 times.
With `ADCS_PORTABLE` functions of angles are those of `adcs_math.c`, at several times the cost.
"""
_COMPARED = "and compares every bit of commands and state."
_COMPARED_IN_SINGLE = """\
and writes the answers, whose differences `test/differences.py` shows:

    build/replay test/recorded.bin answers.bin
    python3 test/differences.py test/recorded.bin answers.bin
"""


_ARRAY = """ `test/recorded.c` holds
the first steps as an array: with `ADCS_RECORDED` defined the replay takes them, without a file."""
_NO_ARRAY = """ There is no
`test/recorded.c` in single precision: the record has the simulation's doubles, whose bits no board
answers with. A board is compared with another build: let both write their answers to `recorded.bin`
(`make pil` does so for a processor in QEMU) and compare the files byte by byte."""
_NONE = "Nothing here can fail so."
#: What nothing provides, by how the ephemeris on board finds the place.
_MISSING = {
    None: "the model field, the orbit and the Sun, which are handed in",
    "given": "the satellite's position and velocity, which are handed in",
}


def readme_text(
    computer: OnBoard, name: str, steps: int, told: Sequence[Told],
    ephemeris: OnBoardEphemeris | None = None, failures: Sequence[str] = (),
    inputs: Sequence[Input] = (), state_bytes: int = 0,
) -> str:  # fmt: skip
    """The README of the export of a computer with so many recorded steps.

    `told`: the fields of its telemetry; `failures`: places in users' files where a law may fail;
    `inputs`: what is handed in; `state_bytes`: size of its state.
    """
    kind = ephemeris.kind if ephemeris else None
    places = _places(computer, steps, inputs) | {
        "state_bytes": str(state_bytes), "name": name, "version": VERSION,
        "report": "\n".join(f"| `{each.field.name}` | {each.count} | {each.said} |"
                            for each in told),
        "left_out": ", ".join(f"`{each}`" for each in left_out(told)),
        "failures": "\n".join(f"* {kept(each)}" for each in failures) or _NONE,
        "ephemeris": ephemeris_readme(ephemeris) if ephemeris else "",
        "missing": _MISSING.get(kind, "determination of the orbit, whose elements are sent up"),
    }  # fmt: skip
    return fill_template("README.md", places)


def _places(computer: OnBoard, steps: int, inputs: Sequence[Input]) -> dict[str, str]:
    rows = [f"| `{each.name}` | {each.count} | {each.meaning} |" for each in inputs]
    named = [
        f"| `{name}` | {said} |"
        for names in named_constants(computer).values()
        for name, (_, said) in names.items()
    ]
    met = [f"| `{c_constant('met', name)}` | {said} |" for name, said in MET.items()]
    outcomes = [f"| `{c_constant(name)}` | {said} |" for name, said in OUTCOMES.items()]
    rules = [f"| `{name}` | {number} | {said} |" for name, number, said in contract(computer)]
    return {
        "contract": "\n".join(rules), "met": "\n".join(met), "outcomes": "\n".join(outcomes),
        "inputs": "\n".join(rows),
        "constants": "\n".join(named) or "| none | |", "steps": str(steps),
        "array": _NO_ARRAY if is_single() else _ARRAY,
        "bits": _BITS_IN_SINGLE if is_single() else _BITS,
        "compared": _COMPARED_IN_SINGLE if is_single() else _COMPARED,
        "processor": "Cortex-M4F" if is_single() else "Cortex-M7 with `ADCS_PORTABLE`",
    }  # fmt: skip
