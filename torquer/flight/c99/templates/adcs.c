/* Kernels of the on-board computer of $name, exported by torquer $version. */
#include "adcs.h"
#ifdef ADCS_PORTABLE
#include "adcs_math.h"
#endif

#include <float.h>

$checks
$program
$is_region/* A control step: what it answers, and what its laws have asked for. */
static Answer answered(adcs_state *state, const adcs_inputs *inputs)
{
    Given given;
    Answer answer;
${before_step}$copies    answer = $call_gated_step;
${after_step}    return answer;
}

uint32_t adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command)
{
    const Answer answer = answered(state, inputs);
    for (int32_t k = 0; k < 3; k++) {
        command->dipole_a_m2[k] = ${to_double}answer.dipole_a_m2.v[k];
        command->torque_n_m[k] = ${to_double}answer.torque_n_m.v[k];
    }
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
${unread_region}    return $mode;
}

int64_t adcs_failures(const adcs_state *state, int64_t *line)
{
$failures}

double adcs_logged(const adcs_state *state, int32_t cell)
{
$logged}

uint32_t adcs_met(const adcs_state *state)
{
    return (uint32_t)state->gate[0].status;
}

adcs_estimate adcs_estimated(const adcs_state *state)
{
    const adcs_estimate estimate = {$estimated};
    (void)state;
    return estimate;
}

bool adcs_is_held(const adcs_state *state, int32_t region)
{
${unread_region}    return $held;
}

bool adcs_flag(const adcs_state *state, int32_t flag)
{
$flag}

double adcs_parameter(const adcs_state *state, int32_t place)
{
$parameter}

adcs_outcome adcs_command_mode(adcs_state *state, int32_t region, int32_t mode)
{
    (void)state;
    (void)region;
    (void)mode;
    return (adcs_outcome)$call_command_mode;
}

adcs_outcome adcs_hold(adcs_state *state, int32_t region, bool on)
{
    (void)state;
    (void)region;
    (void)on;
    return (adcs_outcome)$call_hold;
}

adcs_outcome adcs_set_flag(adcs_state *state, int32_t flag, bool on)
{
    (void)state;
    (void)flag;
    (void)on;
    return (adcs_outcome)$call_set_flag;
}

adcs_outcome adcs_set_parameter(adcs_state *state, int32_t place, double value)
{
    (void)state;
    (void)place;
    (void)value;
    return (adcs_outcome)$call_set_parameter;
}

adcs_outcome adcs_rebase(adcs_state *state, double shift_s)
{
    return (adcs_outcome)$call_rebase;
}

void adcs_restart_estimators(adcs_state *state)
{
    (void)state;
    $call_restart_estimators;
}
