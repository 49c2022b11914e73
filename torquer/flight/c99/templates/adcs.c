/* Kernels of the on-board computer of $name, exported by torquer $version. */
#include "adcs.h"
#ifdef ADCS_PORTABLE
#include "adcs_math.h"
#endif

#include <float.h>

#if FLT_EVAL_METHOD != 0
#error "doubles must be computed as doubles: on x86 compile with -msse2 -mfpmath=sse"
#endif
#ifdef __FAST_MATH__
#error "compile without -ffast-math: other bits, and NaN is not seen"
#endif

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

${single_test}bool adcs_self_test(void)
{
    volatile double a = 1.0 + 0x1p-27;
    volatile double b = -(1.0 + 0x1p-26);
    volatile double least = 0x1p-1074;
    const double x = a;
    const double y = b;
    return x * x + y == 0.0 && least * 1.0 > 0.0 && sizeof(double) == 8u$self_test;
}

int32_t adcs_mode(const adcs_state *state, int32_t region)
{
    return is_region(state, region) ? (int32_t)state->modes.regions[region].state : -1;
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
