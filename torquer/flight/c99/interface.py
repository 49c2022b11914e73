"""The interface of an export: what flight software hands in and gets, in words and in C."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from torquer.computer.computer import (
    NO_ESTIMATOR,
    OF_LAW,
    SENSOR_READINGS,
    Blocks,
    parameter_places,
)
from torquer.computer.gate import GATE_NOW, MET, OUTCOMES
from torquer.computer.interface import PLACES, SENSORS
from torquer.computer.modes.spec import Modes
from torquer.flight.c99.calls import failure_bit
from torquer.flight.c99.computer import Export, OnBoard
from torquer.flight.c99.prefix import kept
from torquer.flight.c99.tables import count_state_words
from torquer.simulation.setup.prepare import make_log
from torquer.spacecraft.failures import in_words
from torquer.spacecraft.sensors.device import MOST_PARTS
from torquer.spacecraft.sensors.devices import DEVICES, Flown


@dataclass(frozen=True)
class Input:
    """A number or vector that is handed in: its name, where its numbers stand in the computer's
    record in C, what it is; `need`: of what it is a part, "" for what is measured.
    """

    name: str
    places: tuple[str, ...]
    meaning: str
    need: str = ""

    @property
    def count(self) -> int:
        """How many numbers it has."""
        return len(self.places)

    @property
    def is_array(self) -> bool:
        """Whether it is an array in C: a vector, or times of however many readings."""
        return self.count > 1 or "[" in self.places[0]


def inputs_for(computer: OnBoard, made: Export, ephemeris: bool = False) -> list[Input]:
    """The inputs that the computer uses; `ephemeris`: and all that an ephemeris on board writes."""
    units = computer.scenario.spacecraft.units()
    return [
        each
        for each in all_inputs(units, [*made.checks.readings["row"]])
        if any(map(made.keeps_given, map(_field, each.places)))
        or (ephemeris and each.need == "ephemeris")
    ]


def all_inputs(units: Sequence[Flown], rows: Sequence[int]) -> list[Input]:
    """All inputs there may be of a computer that uses the readings of some rows.

    `units`: devices of kinds of which the satellite has several.
    """
    kinds = [
        *((row, each, each.given, each.meaning, in_words(SENSORS[row]))
          for row, each in enumerate(DEVICES)),
        *((each.row, each.device, f"{each.device.given}_{each.name}",
           f"{each.device.meaning}, of {each.name}", each.said) for each in units),
    ]  # fmt: skip
    used = [each for each in kinds if each[0] in rows]
    read = ", ".join(said for *_, said in used)
    return [
        Input("t_s", ("t_s",), "time since the start [s]; steps must not go back"),
        _vector("coil_dipole_body_a_m2", "coils",
                "mean dipole of the coils since the step before, as commanded within limits "
                "[A m^2]"),
        *(Input(name, tuple(f"readings[{row}][{part}]" for part in range(device.count)),
                f"{meaning} [{device.units}]") for row, device, name, meaning, _ in used),
        Input("read_at_s", tuple(f"read_s[{row}]" for row, *_ in used),
              f"when each was read [s], -INFINITY if never: {read}"),
        _vector("r_inertial_m", "position", "position, inertial [m]", "ephemeris"),
        _vector("v_inertial_m_s", "velocity", "velocity, inertial [m/s]", "ephemeris"),
        _vector("b_inertial_t", "model_b", "field of the model there, inertial [T]", "ephemeris"),
        _vector("b_rate_inertial_t_s", "model_b_rate",
                "its rate of change along the orbit [T/s]", "ephemeris"),
        _vector("sun_inertial", "to_sun", "unit vector to the Sun, inertial", "ephemeris"),
        Input("sunlit_fraction", ("sunlit_fraction",),
              "visible part of the Sun's disc, 0 in the umbra", "ephemeris"),
    ]  # fmt: skip


def _vector(name: str, known: str, meaning: str, need: str = "") -> Input:
    return Input(name, tuple(f"{known}_{c}" for c in "xyz"), meaning, need)


def _field(place: str) -> str:
    """The field of the record in which a number stands."""
    return place.partition("[")[0]


def find_place(name: str) -> int:
    """Where a number of the record stands among all of them, by its name in C."""
    field, *indices = re.findall(r"\w+", name)
    row, part = map(int, (*indices, 0, 0)[:2])
    return PLACES[field].start + (MOST_PARTS if field == "readings" else 1) * row + part


def handed_in(inputs: Sequence[Input]) -> dict[str, int]:
    """Where each number that is handed in stands in the computer's record in C, in the order of the
    inputs, with its place among all numbers. (The computer writes the estimate itself.)"""
    return {place: find_place(place) for each in inputs for place in each.places}


def input_members(inputs: Sequence[Input]) -> str:
    """Members of the struct of inputs."""
    lines = []
    for each in inputs:
        size = f"[{each.count}]" if each.is_array else ""
        lines.append(f"    /* {each.meaning} */\n    double {each.name}{size};\n")
    return "".join(lines)


def input_copies(inputs: Sequence[Input], made: Export) -> str:
    """Statements that put the inputs into the computer's record, of those that it takes over."""
    return "".join(
        f"    given.{place} = inputs->{each.name}{f'[{k}]' if each.is_array else ''};\n"
        for each in inputs
        for k, place in enumerate(each.places)
        if made.keeps_given(_field(place))
    )


def c_constant(*words: str) -> str:
    """The name of a constant made of words."""
    return re.sub(r"\W+", "_", "_".join(["adcs", *words]), flags=re.ASCII).upper()


#: Why a number of a law or estimator of the package may be any.
_ANY_IS_MEANT = "either sign and any size has a meaning"
#: Numbers of what stands in place of an estimator.
_NO_ESTIMATORS = {
    "ADCS_READINGS": (SENSOR_READINGS, "in place of an estimator: attitude sensor and gyro"),
    "ADCS_NO_ESTIMATOR": (NO_ESTIMATOR, "no estimator works"),
    "ADCS_LAWS_ESTIMATE": (OF_LAW, "what a law estimates"),
}


def named_constants(computer: OnBoard) -> dict[str, dict[str, tuple[int, str]]]:
    """Numbers with names for the header, by what they are: name -> (number, what it is)."""
    modes = computer.scenario.control.named().modes
    found: dict[str, dict[str, tuple[int, str]]] = {
        "regions": {}, "states": {}, "flags": {}, "laws": {}, "estimators": {}, "logs": {},
        "parameters": {}, "failures": {},
    }  # fmt: skip
    for number, (region, state) in enumerate(_states(modes)):
        _name(found["states"], number, f"{region}: {state}", "state", region, state)
    for place, name in enumerate(modes.regions if modes else ()):
        _name(found["regions"], place, f"region {name}", "region", name)
    for place, flag in enumerate(modes.flags if modes else ()):
        _name(found["flags"], place, f"flag {flag}", "flag", flag)
    for number, name in enumerate(computer.blocks.laws):
        _name(found["laws"], number, f"law {name}", "law", name)
    for number, name in enumerate(computer.blocks.estimators):
        _name(found["estimators"], number, f"estimator {name}", "estimator", name)
    found["estimators"] |= _NO_ESTIMATORS
    for name, _, part, cells in make_log(computer.blocks):
        said = f"{name} [{part.unit or 'units by axis'}], {len(cells)} cells"
        _name(found["logs"], cells[0], said, "log", name)
    for name, (first, count) in parameter_places(computer.blocks).items():
        said = f"{name}, {count} numbers{say_limits(computer.blocks, name)}"
        _name(found["parameters"], first, said, "parameter", name)
    for number, (name, block) in enumerate(computer.blocks.by_key().items()):
        if not block.is_built_in:
            said = f"{block.kind.name} {name} has failed"
            _name(found["failures"], failure_bit(number), said, "failed", name)
    return found


def say_limits(blocks: Blocks, name: str) -> str:
    """What the numbers of `BLOCK.PARAMETER` may be set to, to follow what it is called."""
    key, _, parameter = name.rpartition(".")
    block = blocks.by_key()[key]
    if parameter in block.fixed:
        return ", not set in flight"
    first, count = block.places()[parameter]
    why = _ANY_IS_MEANT if block.is_built_in else f"its {block.kind.name} declares no limits"
    words = [str(each) or f"any finite ({why})" for each in block.limits[first : first + count]]
    return f": {words[0] if len(set(words)) == 1 else '; '.join(words)}" if words else ""


def _states(modes: Modes | None) -> list[tuple[str, str]]:
    """Region and state, by the numbers of the states."""
    regions = modes.regions.items() if modes else ()
    return [(name, state) for name, region in regions for state in region.states]


def _name(of: dict[str, tuple[int, str]], number: int, said: str, *words: str) -> None:
    """Add a constant; two that would have one name in C are numbered."""
    name = own = c_constant(*words)
    count = 1
    while own in of:
        count += 1
        own = f"{name}_{count}"
    of[own] = number, kept(said)


def state_bytes(computer: OnBoard, made: Export) -> int:
    """Size of an `adcs_state`: its version and its seal, then what the computer remembers."""
    return 16 + 8 * count_state_words(computer.board, made) + GATE_NOW.itemsize


def outcome_enums() -> dict[str, str]:
    """What a step has met, and what becomes of a command from outside, as constants of C."""
    met = [
        f"#define {c_constant('met', name)} {1 << bit}u /* {said} */\n"
        for bit, (name, said) in enumerate(MET.items())
    ]
    commas = [","] * (len(OUTCOMES) - 1) + [""]
    outcomes = [
        f"    {c_constant(name)} = {number}{comma} /* {said} */\n"
        for number, (comma, (name, said)) in enumerate(zip(commas, OUTCOMES.items(), strict=True))
    ]
    return {"met": "".join(met), "outcomes": "".join(outcomes)}


def contract(computer: OnBoard) -> list[tuple[str, str, str]]:
    """What the caller has to keep to: name of a constant, its number, what it is."""
    control, craft = computer.scenario.control, computer.scenario.spacecraft
    rows = [
        ("CONTROL_PERIOD_S", control.sample_s, "time from one control step to the next [s]"),
        ("MEASURE_S", control.measure_s, "time for which the coils are off to measure [s]"),
        ("ACTUATE_S", control.actuate_s or control.sample_s,
         "time for which the coils then follow the latest dipole [s]"),
        ("GAP_S", computer.gate.gap_s, "longest step of the clock that is believed at once [s]"),
    ]  # fmt: skip
    if control.measure_s > 0.0:
        also = float(control.control_while_actuating)
        rows.append(("CONTROL_WHILE_ACTUATING", also, "1: control steps go on while coils act"))
    for k, limit in enumerate(craft.coils.limits_a_m2().tolist() if craft.coils else ()):
        axis = ", ".join(f"{each:.9g}" for each in craft.coils.axes[k])
        rows.append((f"COIL_{k}_LIMIT_A_M2", limit, f"limit of coil {k}, axis ({axis}) [A m^2]"))
    if craft.wheels is not None:
        wheels = craft.wheels.array()
        for k, limit in enumerate(wheels.torque_limits().tolist()):
            axis = ", ".join(f"{each:.9g}" for each in wheels.axes[k])
            rows.append((f"WHEEL_{k}_LIMIT_N_M", limit, f"limit of wheel {k}, axis ({axis}) [N m]"))
    return [(f"ADCS_{name}", repr(float(number)), said) for name, number, said in rows]


def contract_text(computer: OnBoard) -> str:
    """The same as constants of C."""
    rows = contract(computer)
    return "".join(f"#define {name} {number} /* {said} */\n" for name, number, said in rows)


def mode_names(computer: OnBoard) -> str:
    """The body of a function that names a state by its number."""
    modes = computer.scenario.control.named().modes
    names = [kept(json.dumps(state)) for _, state in _states(modes)]
    if not names:
        return '    (void)mode;\n    return "";\n'
    rows = "".join(f"        {name},\n" for name in names)
    return (
        f"    static const char *const names[{len(names)}] = {{\n{rows[:-2]}}};\n"
        f'    return (mode >= 0 && mode < {len(names)}) ? names[mode] : "";\n'
    )


def enums(computer: OnBoard) -> str:
    """These numbers as constants of C."""
    texts = []
    for what, names in named_constants(computer).items():
        commas = [","] * (len(names) - 1) + [""]  # pedantic readers want none after the last
        lines = [
            f"    {name} = {number}{comma} /* {said} */\n"
            for (name, (number, said)), comma in zip(names.items(), commas, strict=False)
        ]
        if what == "failures":  # of 64 bits, as no enumerator is
            texts += [f"#define {name} INT64_C({number}) /* {said} */\n"
                      for name, (number, said) in names.items()]  # fmt: skip
        elif lines:
            texts.append(f"/* {what} */\nenum {{\n{''.join(lines)}}};\n")
    return "\n".join(texts)
