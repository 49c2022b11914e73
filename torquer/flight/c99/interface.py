"""The interface of an export: what flight software hands in and gets, in words and in C."""

import re
from dataclasses import dataclass

from torquer.computer.computer import parameter_places
from torquer.computer.interface import KNOWN, SENSORS
from torquer.flight.c99.computer import OnBoard
from torquer.simulation.setup.prepare import make_log
from torquer.spacecraft.failures import in_words
from torquer.spacecraft.sensors.sun_cells import CELLS

#: The estimate lies between what sensors read and the ephemeris: the computer writes it itself.
_KNOWN = KNOWN.names or ()
_ESTIMATED = slice(_KNOWN.index("estimate_s"), _KNOWN.index("position_x"))


@dataclass(frozen=True)
class Input:
    """A number or vector that is handed in: its name, how many numbers, what it is, what needs it.

    `need`: name of what a block must declare for it to be read, "" if it may be read always.
    """

    name: str
    count: int
    meaning: str
    need: str = ""


#: All inputs, in the order of `torquer.computer.interface.KNOWN` without the estimate.
INPUTS = (
    Input("t_s", 1, "time since the start [s]; steps must not go back"),
    Input("b_body_t", 3, "magnetometer, body axes [T]"),
    Input("b_rate_body_t_s", 3, "search coil: rate of the field as the body sees it [T/s]",
          "search_coil"),
    Input("omega_body_rad_s", 3, "gyro, absolute rate in body axes [rad/s]"),
    Input("sun_body", 3, "Sun sensors, unit vector in body axes; zeros where none sees it", "sun"),
    Input("q_body_to_inertial", 4, "attitude sensor, (x, y, z, w); NaN while it is blinded"),
    Input("wheel_momentum_body_n_m_s", 3, "sum of the wheels' momenta by tachometers [N m s]"),
    Input("coil_dipole_body_a_m2", 3,
          "mean dipole of the coils since the step before, as commanded within limits [A m^2]"),
    Input("nadir_body", 3, "horizon sensor, unit vector to the Earth; zeros where it sees none",
          "horizon"),
    Input("sun_cells", CELLS, "signals of single Sun cells, parts of full sunlight", "sun_cells"),
    Input("read_at_s", len(SENSORS),
          "when each was read [s], -INFINITY if never: " + ", ".join(map(in_words, SENSORS))),
    Input("r_inertial_m", 3, "position, inertial [m]", "ephemeris"),
    Input("v_inertial_m_s", 3, "velocity, inertial [m/s]", "ephemeris"),
    Input("b_inertial_t", 3, "field of the model there, inertial [T]", "ephemeris"),
    Input("b_rate_inertial_t_s", 3, "its rate of change along the orbit [T/s]", "ephemeris"),
    Input("sun_inertial", 3, "unit vector to the Sun, inertial", "ephemeris"),
    Input("sunlit_fraction", 1, "visible part of the Sun's disc, 0 in the umbra", "ephemeris"),
)  # fmt: skip
#: Names of the computer's record that are handed in, in order.
HANDED_IN = (*_KNOWN[: _ESTIMATED.start], *_KNOWN[_ESTIMATED.stop :])


def input_members() -> str:
    """Members of the struct of inputs."""
    lines = []
    for each in INPUTS:
        size = f"[{each.count}]" if each.count > 1 else ""
        lines.append(f"    /* {each.meaning} */\n    double {each.name}{size};\n")
    return "".join(lines)


def input_copies() -> str:
    """Statements that put the inputs into the computer's record."""
    places = [
        f"{each.name}[{k}]" if each.count > 1 else each.name
        for each in INPUTS
        for k in range(each.count)
    ]
    pairs = zip(HANDED_IN, places, strict=True)
    return "".join(f"    known->{known} = inputs->{place};\n" for known, place in pairs)


def c_constant(*words: str) -> str:
    """The name of a constant made of words."""
    return re.sub(r"\W+", "_", "_".join(["adcs", *words])).upper()


def named_constants(computer: OnBoard) -> dict[str, dict[str, tuple[int, str]]]:
    """Numbers with names for the header, by what they are: name -> (number, what it is)."""
    modes = computer.scenario.control.named().modes
    found: dict[str, dict[str, tuple[int, str]]] = {
        "regions": {}, "states": {}, "flags": {}, "logs": {}, "parameters": {},
    }  # fmt: skip
    if modes is not None:
        number = 0
        for place, (name, region) in enumerate(modes.regions.items()):
            found["regions"][c_constant("region", name)] = place, f"region {name}"
            for state in region.states:
                found["states"][c_constant("state", name, state)] = number, f"{name}: {state}"
                number += 1
        for place, flag in enumerate(modes.flags):
            found["flags"][c_constant("flag", flag)] = place, f"flag {flag}"
    for name, _, part, cells in make_log(computer.blocks):
        unit = part.unit or "units by axis"
        found["logs"][c_constant("log", name)] = cells[0], f"{name} [{unit}], {len(cells)} cells"
    for name, (first, count) in parameter_places(computer.blocks).items():
        found["parameters"][c_constant("parameter", name)] = first, f"{name}, {count} numbers"
    return found


def enums(computer: OnBoard) -> str:
    """These numbers as constants of C."""
    texts = []
    for what, names in named_constants(computer).items():
        commas = [","] * (len(names) - 1) + [""]  # pedantic readers want none after the last
        lines = [
            f"    {name} = {number}{comma} /* {said} */\n"
            for (name, (number, said)), comma in zip(names.items(), commas, strict=False)
        ]
        if lines:
            texts.append(f"/* {what} */\nenum {{\n{''.join(lines)}}};\n")
    return "\n".join(texts)
