"""The interface of an export: what flight software hands in and gets, in words and in C."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from torquer.base.user_source import plain_function
from torquer.compile.sources import is_own
from torquer.computer.computer import (
    NO_ESTIMATOR,
    OF_LAW,
    SENSOR_READINGS,
    parameter_places,
)
from torquer.computer.gate import GATE_NOW, MET, OUTCOMES
from torquer.computer.interface import ESTIMATED, PLACES, SENSORS
from torquer.computer.modes.spec import Modes
from torquer.flight.c99.calls import failure_bit
from torquer.flight.c99.computer import OnBoard
from torquer.flight.c99.prefix import kept
from torquer.flight.c99.tables import count_state_words
from torquer.simulation.setup.prepare import make_log
from torquer.spacecraft.failures import in_words
from torquer.spacecraft.sensors.device import MOST_PARTS
from torquer.spacecraft.sensors.devices import DEVICES, Flown


@dataclass(frozen=True)
class Input:
    """A number or vector that is handed in: its name, how many numbers, what it is, what needs it.

    `need`: name of what a block must declare for it to be read, "" if it may be read always.
    """

    name: str
    count: int
    meaning: str
    need: str = ""


def _numbers(*names: str) -> dict[str, int]:
    """Places of fields that are one number each."""
    return {name: PLACES[name].start for name in names}


def inputs_for(units: Sequence[Flown] = ()) -> list[Input]:
    """All inputs; `units`: devices of kinds of which the satellite has several."""
    devices = [
        Input(each.given, each.count, f"{each.meaning} [{each.units}]", each.need)
        for each in DEVICES
    ]
    several = [
        Input(f"{each.device.given}_{each.name}", each.device.count,
              f"{each.device.meaning}, of {each.name} [{each.device.units}]")
        for each in units
    ]  # fmt: skip
    read = ", ".join([*map(in_words, SENSORS), *(each.said for each in units)])
    return [
        Input("t_s", 1, "time since the start [s]; steps must not go back"),
        Input("coil_dipole_body_a_m2", 3,
              "mean dipole of the coils since the step before, as commanded within limits [A m^2]"),
        *devices,
        *several,
        Input("read_at_s", len(SENSORS) + len(units),
              f"when each was read [s], -INFINITY if never: {read}"),
        Input("r_inertial_m", 3, "position, inertial [m]", "ephemeris"),
        Input("v_inertial_m_s", 3, "velocity, inertial [m/s]", "ephemeris"),
        Input("b_inertial_t", 3, "field of the model there, inertial [T]", "ephemeris"),
        Input("b_rate_inertial_t_s", 3, "its rate of change along the orbit [T/s]", "ephemeris"),
        Input("sun_inertial", 3, "unit vector to the Sun, inertial", "ephemeris"),
        Input("sunlit_fraction", 1, "visible part of the Sun's disc, 0 in the umbra", "ephemeris"),
    ]  # fmt: skip


def handed_in(units: Sequence[Flown] = ()) -> dict[str, int]:
    """Where each number that is handed in stands in the computer's record in C, in the order of the
    inputs, with its place among all numbers. (The computer writes the estimate itself.)"""
    rows = [*enumerate(DEVICES), *((each.row, each.device) for each in units)]
    return {
        **_numbers("t_s"),
        **_numbers(*(f"coils_{c}" for c in "xyz")),
        **{f"readings[{row}][{part}]": PLACES["readings"].start + MOST_PARTS * row + part
           for row, device in rows for part in range(device.count)},
        **{f"read_s[{row}]": PLACES["read_s"].start + row for row, _ in rows},
        **_numbers(*(name for name, places in PLACES.items() if places.start >= ESTIMATED)),
    }  # fmt: skip


def input_members(units: Sequence[Flown] = ()) -> str:
    """Members of the struct of inputs."""
    lines = []
    for each in inputs_for(units):
        size = f"[{each.count}]" if each.count > 1 else ""
        lines.append(f"    /* {each.meaning} */\n    double {each.name}{size};\n")
    return "".join(lines)


def input_copies(units: Sequence[Flown] = ()) -> str:
    """Statements that put the inputs into the computer's record."""
    places = [
        f"{each.name}[{k}]" if each.count > 1 else each.name
        for each in inputs_for(units)
        for k in range(each.count)
    ]
    pairs = zip(handed_in(units), places, strict=True)
    return "".join(f"    given.{known} = inputs->{place};\n" for known, place in pairs)


def c_constant(*words: str) -> str:
    """The name of a constant made of words."""
    return re.sub(r"\W+", "_", "_".join(["adcs", *words]), flags=re.ASCII).upper()


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
        _name(found["parameters"], first, f"{name}, {count} numbers", "parameter", name)
    for number, (name, block) in enumerate(computer.blocks.by_key().items()):
        if not is_own(plain_function(block.function)):
            said = f"{block.kind.name} {name} has failed"
            _name(found["failures"], failure_bit(number), said, "failed", name)
    return found


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


def state_bytes(computer: OnBoard) -> int:
    """Size of an `adcs_state`: its version and its seal, then what the computer remembers."""
    return 16 + 8 * count_state_words(computer.board) + GATE_NOW.itemsize


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
