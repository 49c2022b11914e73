"""Telemetry of an export: fields of the packets that the computer can fill, as C."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from string import Template

from torquer.flight.c99.accessors import estimated_members
from torquer.flight.c99.computer import Export, OnBoard
from torquer.flight.c99.interface import Input
from torquer.flight.c99.precision import is_single, real_word
from torquer.flight.c99.print_c import wrap_line
from torquer.flight.c99.translation import Function
from torquer.flight.c99.types import Array, Tuple
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.fields import Field

#: Fields that are told, by packets of the dictionary, and how C finds number k of each. One is left
#: out where an input that it reads is not read by the computer.
_FOUND: dict[str, dict[str, str]] = {
    "extended": {
        "isolated": "isolated",
        "q_orbital": "(double)orbital$q.v[$k]",
        "q_inertial": "estimate.q_body_to_inertial[$k]",
        "omega_orbital": "(double)orbital$omega.v[$k] * degree",
        "omega": "estimate.omega_body_rad_s[$k] * degree",
        "sigma": "estimate.sigma_rad * degree",
        "estimate_age": "(isfinite(estimate.t_s) != 0) ? inputs->t_s - estimate.t_s : (double)NAN",
        "b": "inputs->b_body_t[$k] * 1e9",
        "gyro": "inputs->omega_body_rad_s[$k] * degree",
        "sun": "inputs->sun_body[$k]",
        "wheel_momentum": "inputs->wheel_momentum_body_n_m_s[$k]",
        "dipole": "command->dipole_a_m2[$k]",
        "torque": "command->torque_n_m[$k]",
    },
    "settings": {"held": "held", "raised": "raised"},
    "modes": {"state": "(uint32_t)(adcs_mode(state, $k) - first_states[$k])"},
}
#: What of inputs, estimate and state a text reads.
_READS = re.compile(r"inputs->\w+|estimate\.\w+|\bisolated\b")
#: What the motion relative to the orbital frame is found from.
_OF_ORBITAL = {
    *("inputs->r_inertial_m", "inputs->v_inertial_m_s"),
    *("estimate.q_body_to_inertial", "estimate.omega_body_rad_s"),
}
#: Degrees in a radian, as the flight software has it.
_DEGREE = f"    const double degree = {180.0 / math.pi!r};\n"
_ORBITAL = """\
    const $q_type q = {{$q}};
    const $v_type omega = {{$omega}};
    const $v_type r = {{$r}};
    const $v_type v = {{$v}};
    const $kind orbital = $name(q, omega, r, v);
"""


@dataclass(frozen=True)
class Told:
    """A field of telemetry: what the dictionary says of it, how many numbers there are, their C."""

    field: Field
    count: int
    texts: list[str]

    @property
    def kind(self) -> str:
        """The type of a number in C."""
        return "uint32_t" if self.field.type.startswith("u") else "double"

    @property
    def said(self) -> str:
        """What it is, with its unit."""
        unit = f" [{self.field.unit}]" if self.field.unit else ""
        return f"{self.field.description}{unit}".replace("*/", "* /")


def told_fields(computer: OnBoard, made: Export, inputs: Sequence[Input]) -> list[Told]:
    """The fields that the computer can fill, of its inputs and of what it keeps."""
    modes = computer.scenario.control.named().modes
    regions = 0 if modes is None else len(modes.regions)
    orbital, members, found = _orbital_frame(made, inputs), {}, []
    read = _read(made, inputs) - ({"isolated"} if not computer.blocks.estimators else set())
    if orbital is not None:
        assert isinstance(orbital.result, Tuple)
        members = {"q": orbital.result.member(0), "omega": orbital.result.member(1)}
    for packet, texts in _FOUND.items():
        fields = {each.name: each for each in _packet(packet)}
        for name, text in texts.items():
            count = min(fields[name].count, regions) if packet == "modes" else fields[name].count
            lacks = not (set(_READS.findall(text)) <= read and ("orbital" not in text or orbital))
            if count and not lacks and (regions or packet != "settings"):
                lines = [Template(text).substitute(members, k=k) for k in range(count)]
                found.append(Told(fields[name], count, lines))
    return found


def left_out(told: Sequence[Told]) -> list[str]:
    """Names of the other fields of these packets."""
    names = {each.field.name for each in told}
    fields = dict.fromkeys(each.name for packet in _FOUND for each in _packet(packet))
    return [name for name in fields if name not in names]


def _packet(name: str) -> tuple[Field, ...]:
    return load_dictionary("chibis_m").down[name].fields


def _read(made: Export, inputs: Sequence[Input]) -> set[str]:
    """What there is for the texts to read."""
    found = {f"inputs->{each.name}" for each in inputs}
    found |= {f"estimate.{each}" for each in estimated_members(made)}
    return found | ({"isolated"} & {*made.known})


def _orbital_frame(made: Export, inputs: Sequence[Input]) -> Function | None:
    """The kernel that finds the motion relative to the orbital frame, if there is what it takes."""
    return made.entries.get("to_orbital_frame") if _read(made, inputs) >= _OF_ORBITAL else None


def called_entries(made: Export, inputs: Sequence[Input]) -> tuple[str, ...]:
    """Names in C of the kernels that the interface calls, telemetry among it."""
    orbital = _orbital_frame(made, inputs)
    return tuple(
        each.name
        for name, each in made.entries.items()
        if name != "to_orbital_frame" or orbital is not None
    )


def telemetry_texts(computer: OnBoard, made: Export, inputs: Sequence[Input]) -> dict[str, str]:
    """Members of the struct, and the statements that fill it."""
    told = told_fields(computer, made, inputs)
    members = "".join(
        f"    /* {each.said} */\n    {each.kind} {each.field.name}{_size(each)};\n" for each in told
    )
    stores = "".join(
        wrap_line(f"    out->{each.field.name}{f'[{k}]' if _size(each) else ''} = {text};", 1)
        + "\n"
        for each in told
        for k, text in enumerate(each.texts)
    )
    before = _before(computer, made, stores)
    words = re.findall(r"\w+", before + stores)
    unread = [f"    (void){name};\n" for name in ("state", "inputs") if name not in words]
    return {"members": members, "fill": before + "".join(unread) + stores}


def _size(told: Told) -> str:
    """Brackets with the length of an array."""
    return f"[{told.count}]" if told.field.count > 1 else ""


def _before(computer: OnBoard, made: Export, stores: str) -> str:
    """What the statements read."""
    texts = []
    if "estimate." in stores or "orbital" in stores:
        texts.append("    const adcs_estimate estimate = adcs_estimated(state);\n")
    if "orbital" in stores:
        texts.append(_orbital(made))
    if "* degree" in stores:
        texts.append(_DEGREE)
    modes = computer.scenario.control.named().modes
    if modes is not None:
        sizes = [len(region.states) for region in modes.regions.values()]
        first = ", ".join(str(sum(sizes[:k])) for k in range(len(sizes)))
        texts.append(f"    static const int32_t first_states[] = {{{first}}};\n")
        texts.append(_bits("held", len(sizes), "adcs_is_held(state, k)"))
        texts.append(_bits("raised", len(modes.flags), "adcs_flag(state, k)"))
    if "= isolated" in stores:
        known = "seen(state)->board.known[0].isolated[k] > 0.0"
        rows = made.known["isolated"]
        assert isinstance(rows, Array)
        texts.append(_bits("isolated", rows.in_c[0] or 0, known))
    return "".join(sorted(texts, key=lambda text: "for (" in text))


def _bits(name: str, count: int, truth: str) -> str:
    if not count:
        return f"    const uint32_t {name} = 0;\n"
    return (
        f"    uint32_t {name} = 0;\n"
        f"    for (int32_t k = 0; k < {min(count, 32)}; k++) {{\n"
        f"        {name} |= {truth} ? ((uint32_t)1 << (uint32_t)k) : 0u;\n    }}\n"
    )


def _orbital(made: Export) -> str:
    """The motion relative to the orbital frame."""
    function, program = made.entries["to_orbital_frame"], made.program
    kinds = dict(function.arguments)
    cast = f"({real_word()})" if is_single() else ""
    places = {
        "q": ("estimate.q_body_to_inertial", 4), "omega": ("estimate.omega_body_rad_s", 3),
        "r": ("inputs->r_inertial_m", 3), "v": ("inputs->v_inertial_m_s", 3),
    }  # fmt: skip
    numbers = {
        name: ", ".join(f"{cast}{place}[{k}]" for k in range(count))
        for name, (place, count) in places.items()
    }
    text = Template(_ORBITAL).substitute(
        numbers, q_type=program.type_name(kinds["q"]), v_type=program.type_name(kinds["v"]),
        kind=program.type_name(function.result), name=function.name,
    )  # fmt: skip
    return "".join(f"{wrap_line(line, 1)}\n" for line in text.splitlines())
