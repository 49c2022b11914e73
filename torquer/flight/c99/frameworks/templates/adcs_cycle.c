/* The control cycle of $name around its library, exported by torquer $version. */
#include "adcs_cycle.h"

#include <string.h>

void adcs_cycle_begin(adcs_cycle *cycle)
{
    memset(cycle, 0, sizeof *cycle);
    adcs_init(&cycle->state);
}

bool adcs_cycle_is_due(const adcs_cycle *cycle)
{
    const int32_t acting = cycle->tick - ADCS_MEASURE_TICKS;
    if (acting > 0) {
        return ADCS_STEPS_WHILE_ACTING != 0 && acting % ADCS_SAMPLE_TICKS == 0;
    }
    return cycle->tick % ADCS_SAMPLE_TICKS == 0;
}

static void leave_coils(adcs_cycle *cycle)
{
    memset(cycle->driven_dipole_a_m2, 0, sizeof cycle->driven_dipole_a_m2);
}

bool adcs_cycle_opens_window(adcs_cycle *cycle)
{
    const bool opens = cycle->tick == 0 && ADCS_MEASURE_TICKS > 0;
    if (opens) {
        leave_coils(cycle);
    }
    return opens;
}

void adcs_cycle_step(adcs_cycle *cycle, const adcs_inputs *inputs)
{
    const adcs_command none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    const uint32_t before = cycle->met;
    cycle->command = none;
    cycle->met = 0;
    if (inputs != NULL) {
        cycle->met = adcs_step(&cycle->state, inputs, &cycle->command);
        cycle->steps++;
    } else {
        cycle->missed++;
    }
    cycle->risen = cycle->met & ~before;
    if (inputs == NULL || cycle->tick < ADCS_MEASURE_TICKS) {
        leave_coils(cycle);
    } else if (cycle->tick == ADCS_MEASURE_TICKS) {
        memcpy(cycle->driven_dipole_a_m2, cycle->command.dipole_a_m2,
            sizeof cycle->driven_dipole_a_m2);
    } else {
        /* they hold the dipole of the window's end */
    }
}

void adcs_cycle_tick(adcs_cycle *cycle)
{
    cycle->tick = (cycle->tick + 1) % ADCS_CYCLE_TICKS;
}

const char *adcs_outcome_text(adcs_outcome outcome)
{
    switch (outcome) {
$outcomes    default:
        return "unknown";
    }
}
