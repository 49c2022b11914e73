"""The exported computer as the simulation calls it: a file of C between their two memories."""

from torquer.control.computer import Board
from torquer.export.tables import numbers_in
from torquer.interface import KNOWN

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

/* Numbers of each array, and places that it has in the struct. */
static const size_t lengths[PARTS] = {{{lengths}}};
static const size_t places[PARTS] = {{{places}}};

void adcs_first(double *numbers);
void adcs_in_the_loop({arguments},
    double *answer);

/* Parameters, then memory, at the start. */
void adcs_first(double *numbers)
{{
    adcs_state state;
    adcs_init(&state);
    memcpy(numbers, state.parameters, sizeof state.parameters);
    memcpy(numbers + sizeof state.parameters / sizeof(double), state.memory, sizeof state.memory);
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
        if (lengths[k] > 0) {{
            memcpy(numbers, parts[k], lengths[k] * sizeof(double));
        }} else {{
            memset(numbers, 0, places[k] * sizeof(double));
        }}
        numbers += places[k];
    }}
    memcpy(given, known, READINGS * sizeof(double));
    memcpy(given + READINGS, known + EPHEMERIS, sizeof inputs - READINGS * sizeof(double));
    adcs_step(&state, &inputs, &command);
    numbers = (double *)(void *)&state;
    for (size_t k = 0; k < PARTS; k++) {{
        memcpy(parts[k], numbers, lengths[k] * sizeof(double));
        numbers += places[k];
    }}
    memcpy(answer, command.dipole_a_m2, sizeof command.dipole_a_m2);
    memcpy(answer + 3, command.torque_n_m, sizeof command.torque_n_m);
}}
"""


def in_the_loop_text(name: str, board: Board) -> str:
    """The file `test/in_the_loop.c` of a computer."""
    arrays = [board.known, board.parameters, board.memory, *board.modes, board.chosen]
    fields = KNOWN.names or ()
    lengths = [len(numbers_in(array)) if len(array) else 0 for array in arrays]
    places = [len(numbers_in(array)) for array in arrays]
    arguments = [f"double *{part}" for part in _PARTS]
    lines = [", ".join(arguments[first : first + 4]) for first in range(0, len(arguments), 4)]
    return _TEXT.format(
        name=name, parts=len(_PARTS), readings=fields.index("estimate_s"),
        ephemeris=fields.index("position_x"), lengths=", ".join(map(str, lengths)),
        places=", ".join(map(str, places)),
        arguments=",\n    ".join(lines), names=", ".join(_PARTS),
    )  # fmt: skip
