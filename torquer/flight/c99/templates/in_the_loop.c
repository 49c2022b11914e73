/* The computer of $name as the simulation calls it: torquer run SCENARIO --computer FOLDER

   The simulation keeps the state in arrays of its own, of which the state in C has what the computer
   uses. That is copied into it, one control step is taken, and it is copied back. The simulation
   knows no prefix: what it calls has names of its own. */
#include "../adcs.c"

#include <string.h>

#define PARTS 13
#define COUNT $count
#define GIVEN $given

/* Of each word of the state: the array in which it stands in the simulation, and its place there. */
static const uint16_t rows[COUNT][2] = {$rows};
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
    adcs_state state;
    const OnBoard *own;
    adcs_init(&state);
    own = seen(&state);
    (void)own;
    (void)numbers;
$first}

void torquer_step(double *known, double *parameters, double *memory, double *regions,
    double *states, double *transitions, double *conditions, double *clock,
    double *sensors, double *checks, double *flags, double *chosen, double *selected,
    double *answer)
{
    double *const parts[PARTS] = {known, parameters, memory, regions, states, transitions, conditions, clock, sensors, checks, flags, chosen, selected};
    OnBoard own;
    adcs_inputs inputs;
    Answer found;
    uint8_t *const words = (uint8_t *)&own.board;
    uint8_t *const given = (uint8_t *)&inputs;
    memset(&own, 0, sizeof own);
    for (size_t k = 0; k < COUNT; k++) {
        if (rows[k][0] < PARTS) {
            memcpy(words + (k * sizeof(double)), parts[rows[k][0]] + rows[k][1], sizeof(double));
        }
    }
$put_floats    for (size_t k = 0; k < GIVEN; k++) {
        memcpy(given + (k * sizeof(double)), known + places[k], sizeof(double));
    }
    own.gate[0] = fresh[0];
    found = answered(&own, &inputs);
    for (size_t k = 0; k < COUNT; k++) {
        if (rows[k][0] < PARTS) {
            memcpy(parts[rows[k][0]] + rows[k][1], words + (k * sizeof(double)), sizeof(double));
        }
    }
$get_floats    for (size_t k = 0; k < 3u; k++) {
        answer[k] = (double)found.asked.dipole_a_m2.v[k];
        answer[3u + k] = (double)found.asked.torque_n_m.v[k];
    }
    if ((found.status & ADCS_MET_LAW_FAILED) != 0) { /* a run ends where a law raises an error */
        answer[0] = (double)NAN;
$failed    }
}
