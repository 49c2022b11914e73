/* On-board computer of $name, exported by torquer $version.

   Estimators, modes and laws of the control step; SI units. Body axes are those of the scenario,
   the inertial frame is that of the ephemeris that is handed in (GCRS); quaternions are
   (x, y, z, w) and take body components to inertial ones. No memory is allocated and no variable
   of the library is written: all that changes is in the state. */
#ifndef ADCS_H
#define ADCS_H

#include "adcs_types.h"

${precision}$enums
/* What the computer is given at a control step: the latest readings with their times. */
typedef struct {
$inputs} adcs_inputs;

/* What it answers, in body axes: dipole of the coils [A m^2], torque on the body by wheels [N m].
   Limits of the coils, their polarity and the torques of single wheels are the drivers'. */
typedef struct {
    double dipole_a_m2[3];
    double torque_n_m[3];
} adcs_command;

/* Begin: parameters, memory and modes as at the start of the scenario. */
void adcs_init(adcs_state *state);

/* One control step. */
void adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command);

/* Whether this build computes with the bits of the export: products, sums and quotients
   rounded one by one, no flushed zeros, NaN seen, words in the order of IEEE 754. */
bool adcs_self_test(void);

/* Version of torquer, mark of its sources, mark of the computer: which export this is. */
const char *adcs_fingerprint(void);

/* Number of the state (ADCS_STATE_...) in which a region (ADCS_REGION_...) is; -1 for none. */
int32_t adcs_mode(const adcs_state *state, int32_t region);

/* Laws and estimators of the user's that have failed since the start (bits ADCS_FAILED_...), as they
   would end a simulation: by an index that is not in its table, or by a division by zero. One that
   fails commands nothing, or estimates nothing, at that step. `line`: where in its Python file the
   latest failed, 0 for none. */
int64_t adcs_failures(const adcs_state *state, int64_t *line);

/* A logged value: the cell ADCS_LOG_... or one that follows it; NaN beyond the memory. */
double adcs_logged(const adcs_state *state, int32_t cell);

/* Have a region enter a state at the next step, as a transition would. */
void adcs_command_mode(adcs_state *state, int32_t region, int32_t mode);

/* Keep the transitions of a region from firing, or let them again. */
void adcs_hold(adcs_state *state, int32_t region, bool on);

/* Raise or lower a flag (ADCS_FLAG_...) from the next step on. */
void adcs_set_flag(adcs_state *state, int32_t flag, bool on);

/* Set a number of a parameter (ADCS_PARAMETER_... and those that follow it), SI. */
void adcs_set_parameter(adcs_state *state, int32_t place, double value);

#endif
