/* The computer of $name as the simulation calls it: torquer run SCENARIO --computer FOLDER

   The simulation keeps the state in arrays of its own. They are copied into the state, one control
   step is taken through the interface of adcs.h, and the state is copied back. An array of no
   length has one row in the struct, which stays zero. The simulation knows no prefix: what it calls
   has names of its own. */
#include "adcs_types.h"

#include <string.h>

#define PARTS 13
#define GIVEN $given

#define PARAMETERS 1u

/* Numbers of each array, and words of 64 bits that it has in the struct. */
static const size_t lengths[PARTS] = {$lengths};
static const size_t words[PARTS] = {$words};
/* Where what is given at a control step stands among the numbers that are known. */
static const size_t places[GIVEN] = {$places};

/* The gate of each call is a new one: the simulation's clock needs none. */
$fresh
const char *torquer_fingerprint(void);
bool torquer_self_test(void);
void torquer_first(double *numbers);
void torquer_step(double *known, double *parameters, double *memory, double *regions,
    double *states, double *transitions, double *conditions, double *clock,
    double *sensors, double *checks, double *flags, double *chosen, double *selected,
    double *answer);

/* An array of the simulation into its place in the state. */
static void put(double *place, const double *part, size_t k)
{
${put_floats}    if (lengths[k] > 0) {
        memcpy(place, part, lengths[k] * sizeof(double));
    } else {
        memset(place, 0, words[k] * sizeof(double));
    }
}

/* An array of the simulation from its place in the state. */
static void get(double *part, const double *place, size_t k)
{
${get_floats}    memcpy(part, place, lengths[k] * sizeof(double));
}

const char *torquer_fingerprint(void)
{
    return adcs_fingerprint();
}

bool torquer_self_test(void)
{
    return adcs_self_test();
}

/* Parameters, then memory, at the start, into zeros. */
void torquer_first(double *numbers)
{
    const size_t memory = (lengths[PARAMETERS] > 0) ? lengths[PARAMETERS] : 1u;
    adcs_state state;
    const OnBoard *own = &((const Held *)(const void *)&state)->now;
    adcs_init(&state);
    get(numbers, (const double *)(const void *)own->board.parameters, PARAMETERS);
    memcpy(numbers + memory, own->board.memory, sizeof own->board.memory);
}

void torquer_step(double *known, double *parameters, double *memory, double *regions,
    double *states, double *transitions, double *conditions, double *clock,
    double *sensors, double *checks, double *flags, double *chosen, double *selected,
    double *answer)
{
    double *const parts[PARTS] = {known, parameters, memory, regions, states, transitions, conditions, clock, sensors, checks, flags, chosen, selected};
    adcs_state state;
    adcs_inputs inputs;
    adcs_command command;
    Held *held = (Held *)(void *)&state;
    OnBoard *own = &held->now;
    double *numbers = (double *)(void *)own;
    double *given = (double *)(void *)&inputs;
    for (size_t k = 0; k < PARTS; k++) {
        put(numbers, parts[k], k);
        numbers += words[k];
    }
    for (size_t k = 0; k < GIVEN; k++) {
        given[k] = known[places[k]];
    }
    held->version = ADCS_STATE_VERSION;
    own->gate[0] = fresh[0];
    memset(&own->board.failures, 0, sizeof own->board.failures);
    (void)adcs_step(&state, &inputs, &command);
    numbers = (double *)(void *)own;
    for (size_t k = 0; k < PARTS; k++) {
        get(parts[k], numbers, k);
        numbers += words[k];
    }
    memcpy(answer, &own->gate[0].dipole_x, 6u * sizeof(double));
    if (own->board.failures.blocks != 0) { /* a run ends where a law raises an error */
        answer[0] = (double)NAN;
    }
}
