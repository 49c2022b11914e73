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
    const size_t count = sizeof state->board.modes.regions / sizeof state->board.modes.regions[0];
    return $has_modes && region >= 0 && (size_t)region < count;
}

uint32_t adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command)
{
    const int64_t before = state->board.failures.blocks;
    Known given;
    Answer answer;
    state->board.failures.blocks = 0;
$copies    answer = $call_gated_step;
    for (int32_t k = 0; k < 3; k++) {
        command->dipole_a_m2[k] = ${to_double}answer.dipole_a_m2.v[k];
        command->torque_n_m[k] = ${to_double}answer.torque_n_m.v[k];
    }
    if (state->board.failures.blocks != 0) {
        answer.status |= ADCS_MET_LAW_FAILED;
        state->gate[0].status = (double)answer.status;
    }
    state->board.failures.blocks |= before;
    return (uint32_t)answer.status;
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
    return is_region(state, region) ? (int32_t)state->board.modes.regions[region].state : -1;
}

int64_t adcs_failures(const adcs_state *state, int64_t *line)
{
    *line = state->board.failures.line;
    return state->board.failures.blocks;
}

double adcs_logged(const adcs_state *state, int32_t cell)
{
    const size_t count = sizeof state->board.memory / sizeof state->board.memory[0];
    return (cell >= 0 && (size_t)cell < count) ? state->board.memory[cell] : (double)NAN;
}

uint32_t adcs_met(const adcs_state *state)
{
    return (uint32_t)state->gate[0].status;
}

adcs_estimate adcs_estimated(const adcs_state *state)
{
    const Known *known = &state->board.known[0];
    const adcs_estimate estimate = {
        known->estimate_s + state->gate[0].offset_s,
        {known->estimate_q_x, known->estimate_q_y, known->estimate_q_z, known->estimate_q_w},
        {known->estimate_omega_x, known->estimate_omega_y, known->estimate_omega_z},
        {known->estimate_bias_x, known->estimate_bias_y, known->estimate_bias_z},
        known->sigma_rad, known->sigma_rad_s};
    return estimate;
}

bool adcs_is_held(const adcs_state *state, int32_t region)
{
    return is_region(state, region) && state->board.modes.regions[region].held > 0.0;
}

bool adcs_flag(const adcs_state *state, int32_t flag)
{
    const size_t count = sizeof state->board.modes.flags / sizeof state->board.modes.flags[0];
    return flag >= 0 && (size_t)flag < count && state->board.modes.flags[flag] > 0.0;
}

double adcs_parameter(const adcs_state *state, int32_t place)
{
    const size_t count = sizeof state->board.parameters / sizeof state->board.parameters[0];
    return (place >= 0 && (size_t)place < count) ? ${to_double}state->board.parameters[place] : (double)NAN;
}

adcs_outcome adcs_command_mode(adcs_state *state, int32_t region, int32_t mode)
{
    return (adcs_outcome)$call_command_mode;
}

adcs_outcome adcs_hold(adcs_state *state, int32_t region, bool on)
{
    return (adcs_outcome)$call_hold;
}

adcs_outcome adcs_set_flag(adcs_state *state, int32_t flag, bool on)
{
    return (adcs_outcome)$call_set_flag;
}

adcs_outcome adcs_set_parameter(adcs_state *state, int32_t place, double value)
{
    return (adcs_outcome)$call_set_parameter;
}

adcs_outcome adcs_rebase(adcs_state *state, double shift_s)
{
    return (adcs_outcome)$call_rebase;
}

void adcs_restart_estimators(adcs_state *state)
{
    $call_restart_estimators;
}
