/* Kernels of the on-board computer of $name, exported by torquer $version. */
#include "adcs.h"
#ifdef ADCS_PORTABLE
#include "adcs_math.h"
#endif

#include <float.h>

$checks
$program
static bool is_region(const adcs_state *state, int32_t region)
{
    const size_t count = sizeof state->modes.regions / sizeof state->modes.regions[0];
    return $has_modes && region >= 0 && (size_t)region < count;
}

void adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command)
{
    Known *known = &state->known[0];
    Command made;
$copies    made = $step($arguments);
    for (int32_t k = 0; k < 3; k++) {
        command->dipole_a_m2[k] = ${to_double}made.dipole_a_m2.v[k];
        command->torque_n_m[k] = ${to_double}made.torque_n_m.v[k];
    }
}

$exact
/* Whether numbers have the words of IEEE 754, their bytes in the order of those of whole numbers. */
static bool are_words_in_order(void)
{
    const uint64_t word = 0xc00921fb54442d18u;
    volatile double hidden = -3.141592653589793;
    const double number = hidden;
    const uint8_t *expected = (const uint8_t *)&word;
    const uint8_t *found = (const uint8_t *)&number;
    bool same = sizeof(double) == sizeof word && sizeof(float) == 4u;
    for (size_t k = 0; same && (k < sizeof word); k++) {
        same = expected[k] == found[k];
    }
    return same;
}

bool adcs_self_test(void)
{
    return $is_exact && are_words_in_order();
}

int32_t adcs_mode(const adcs_state *state, int32_t region)
{
    return is_region(state, region) ? (int32_t)state->modes.regions[region].state : -1;
}

int64_t adcs_failures(const adcs_state *state, int64_t *line)
{
    *line = state->failures.line;
    return state->failures.blocks;
}

double adcs_logged(const adcs_state *state, int32_t cell)
{
    const size_t count = sizeof state->memory / sizeof state->memory[0];
    return (cell >= 0 && (size_t)cell < count) ? state->memory[cell] : (double)NAN;
}

void adcs_command_mode(adcs_state *state, int32_t region, int32_t mode)
{
    if (is_region(state, region)) {
        state->modes.regions[region].commanded = (double)mode;
    }
}

void adcs_hold(adcs_state *state, int32_t region, bool on)
{
    if (is_region(state, region)) {
        state->modes.regions[region].held = on ? 1.0 : 0.0;
    }
}

void adcs_set_flag(adcs_state *state, int32_t flag, bool on)
{
    const size_t count = sizeof state->modes.flags / sizeof state->modes.flags[0];
    if (flag >= 0 && (size_t)flag < count) {
        state->modes.flags[flag] = on ? 1.0 : 0.0;
    }
}

void adcs_set_parameter(adcs_state *state, int32_t place, double value)
{
    const size_t count = sizeof state->parameters / sizeof state->parameters[0];
    if (place >= 0 && (size_t)place < count) {
        state->parameters[place] = ${to_real}value;
    }
}
