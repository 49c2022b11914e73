"""The exported computer as the simulation calls it: a file of C between their two memories."""

from collections.abc import Sequence

from torquer.computer.computer import Board
from torquer.flight.c99.interface import handed_in
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.tables import numbers_in, state_parts
from torquer.flight.c99.texts import fill_template
from torquer.spacecraft.sensors.devices import Flown

#: Parameters are floats; those that C has not set keep all digits in the simulation.
_PUT_FLOATS = """\
    if (k == PARAMETERS) {
        float *floats = (float *)(void *)place;
        memset(place, 0, words[k] * sizeof(double));
        for (size_t n = 0; n < lengths[k]; n++) {
            floats[n] = (float)part[n];
        }
        return;
    }
"""
_GET_FLOATS = """\
    if (k == PARAMETERS) {
        const float *floats = (const float *)(const void *)place;
        for (size_t n = 0; n < lengths[k]; n++) {
            part[n] = (floats[n] == (float)part[n]) ? part[n] : (double)floats[n];
        }
        return;
    }
"""


def in_the_loop_text(name: str, board: Board, fresh: str, units: Sequence[Flown] = ()) -> str:
    """The file `test/in_the_loop.c` of a computer."""
    arrays, given = state_parts(board), handed_in(units)
    lengths = [len(numbers_in(array)) if len(array) else 0 for array in arrays]
    words = [len(numbers_in(array)) for array in arrays]
    put_floats = get_floats = ""
    if is_single():
        words[1], put_floats, get_floats = (words[1] + 1) // 2, _PUT_FLOATS, _GET_FLOATS
    places = {
        "name": name, "put_floats": put_floats, "get_floats": get_floats,
        "places": ", ".join(map(str, given.values())), "given": str(len(given)),
        "lengths": ", ".join(map(str, lengths)), "words": ", ".join(map(str, words)),
        "fresh": fresh,
    }  # fmt: skip
    return fill_template("in_the_loop.c", places)
