"""The exported computer as the simulation calls it: a file of C between their two memories."""

from torquer.computer.computer import Board
from torquer.computer.interface import KNOWN
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.tables import numbers_in

#: Names of the arrays of a board, in the order of the struct of the state.
_PARTS = (
    *("known", "parameters", "memory", "regions", "states", "transitions", "conditions", "clock"),
    *("sensors", "checks", "flags", "chosen"),
)

_TEXT = """\
/* The computer of {name} as the simulation calls it: torquer run SCENARIO --computer FOLDER

   The simulation keeps the state in arrays of its own. They are copied into the state, one control
   step is taken through the interface of adcs.h, and the state is copied back. An array of no
   length has one row in the struct, which stays zero. */
#include "adcs.h"

#include <string.h>

#define PARTS {parts}
#define READINGS {readings}
#define EPHEMERIS {ephemeris}

#define PARAMETERS 1u

/* Numbers of each array, and words of 64 bits that it has in the struct. */
static const size_t lengths[PARTS] = {{{lengths}}};
static const size_t words[PARTS] = {{{words}}};

void adcs_first(double *numbers);
void adcs_in_the_loop({arguments},
    double *answer);

/* An array of the simulation into its place in the state. */
static void put(double *place, const double *part, size_t k)
{{
{put}}}

/* An array of the simulation from its place in the state. */
static void get(double *part, const double *place, size_t k)
{{
{get}}}

/* Parameters, then memory, at the start, into zeros. */
void adcs_first(double *numbers)
{{
    const size_t memory = (lengths[PARAMETERS] > 0) ? lengths[PARAMETERS] : 1u;
    adcs_state state;
    adcs_init(&state);
    get(numbers, (const double *)(const void *)state.parameters, PARAMETERS);
    memcpy(numbers + memory, state.memory, sizeof state.memory);
}}

void adcs_in_the_loop({arguments},
    double *answer)
{{
    double *const parts[PARTS] = {{{names}}};
    adcs_state state;
    adcs_inputs inputs;
    adcs_command command;
    double *numbers = (double *)(void *)&state;
    double *given = (double *)(void *)&inputs;
    for (size_t k = 0; k < PARTS; k++) {{
        put(numbers, parts[k], k);
        numbers += words[k];
    }}
    memcpy(given, known, READINGS * sizeof(double));
    memcpy(given + READINGS, known + EPHEMERIS, sizeof inputs - READINGS * sizeof(double));
    adcs_step(&state, &inputs, &command);
    numbers = (double *)(void *)&state;
    for (size_t k = 0; k < PARTS; k++) {{
        get(parts[k], numbers, k);
        numbers += words[k];
    }}
    memcpy(answer, command.dipole_a_m2, sizeof command.dipole_a_m2);
    memcpy(answer + 3, command.torque_n_m, sizeof command.torque_n_m);
}}
"""

_PUT = """\
    if (lengths[k] > 0) {
        memcpy(place, part, lengths[k] * sizeof(double));
    } else {
        memset(place, 0, words[k] * sizeof(double));
    }
"""
_GET = """\
    memcpy(part, place, lengths[k] * sizeof(double));
"""
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


def in_the_loop_text(name: str, board: Board) -> str:
    """The file `test/in_the_loop.c` of a computer."""
    arrays = [board.known, board.parameters, board.memory, *board.modes, board.chosen]
    fields = KNOWN.names or ()
    lengths = [len(numbers_in(array)) if len(array) else 0 for array in arrays]
    words = [len(numbers_in(array)) for array in arrays]
    put, get = _PUT, _GET
    if is_single():
        words[1], put, get = (words[1] + 1) // 2, _PUT_FLOATS + _PUT, _GET_FLOATS + _GET
    arguments = [f"double *{part}" for part in _PARTS]
    lines = [", ".join(arguments[first : first + 4]) for first in range(0, len(arguments), 4)]
    return _TEXT.format(
        name=name, parts=len(_PARTS), readings=fields.index("estimate_s"),
        ephemeris=fields.index("position_x"), lengths=", ".join(map(str, lengths)),
        words=", ".join(map(str, words)), put=put, get=get,
        arguments=",\n    ".join(lines), names=", ".join(_PARTS),
    )  # fmt: skip
