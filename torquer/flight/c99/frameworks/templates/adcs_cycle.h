/* The control cycle of $name around its library, exported by torquer $version.

   A scheduler calls at every tick. Control steps are due at some of them; while sensors measure the
   coils are off. */
#ifndef ADCS_CYCLE_H
#define ADCS_CYCLE_H

#include "adcs.h"

/* Length of a tick [ns]; lengths of the cycle and of its measurement window, and time from one
   control step to the next, in ticks. */
#define ADCS_TICK_NS INT64_C($tick_ns)
#define ADCS_CYCLE_TICKS $cycle
#define ADCS_MEASURE_TICKS $measure
#define ADCS_SAMPLE_TICKS $sample
/* 1: control steps go on while the coils act, which hold their dipole then. */
#define ADCS_STEPS_WHILE_ACTING $while_acting

typedef struct {
    adcs_state state;
    /* what the laws command, and what the coils are to make of it until the next control step */
    adcs_command command;
    double driven_dipole_a_m2[3];
    /* what the last step has met, and what of it the one before had not */
    uint32_t met;
    uint32_t risen;
    uint32_t steps;
    /* steps that were due and had no inputs */
    uint32_t missed;
    /* the present one, from 0 to ADCS_CYCLE_TICKS - 1 */
    int32_t tick;
} adcs_cycle;

/* Begin: the state of the start, the first tick of a cycle, no command. */
void adcs_cycle_begin(adcs_cycle *cycle);

/* Whether a control step is due at the present tick. */
bool adcs_cycle_is_due(const adcs_cycle *cycle);

/* Whether sensors measure from the present tick on: then the coils are to make nothing, from before
   any is read. */
bool adcs_cycle_opens_window(adcs_cycle *cycle);

/* The control step of the present tick. Without inputs (NULL) it commands nothing. */
void adcs_cycle_step(adcs_cycle *cycle, const adcs_inputs *inputs);

/* Go on to the next tick. */
void adcs_cycle_tick(adcs_cycle *cycle);

/* What became of a command, in words. */
const char *adcs_outcome_text(adcs_outcome outcome);

#endif
