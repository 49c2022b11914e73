/* On-board computer of $name, exported by torquer $version.

   Estimators, modes and laws of the control step; SI units. Body axes are those of the scenario,
   the inertial frame is that of the ephemeris that is handed in (GCRS); quaternions are
   (x, y, z, w) and take body components to inertial ones. No memory is allocated and no variable
   of the library is written: all that changes is in the state. */
#ifndef ADCS_H
#define ADCS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Mark of this header: adcs_interface_version() has it if library and header are of one export. */
#define ADCS_INTERFACE_VERSION ${interface}u

/* Stack: its size is your compiler's. `make stack CC=... CFLAGS=...` with your GCC computes the worst
   case of all functions below by the graph of calls, and writes it into adcs_stack.h as
   ADCS_STACK_BYTES. Nothing calls itself, or by address; no array has a size of run time. */

/* All that changes. It may be static, copied and kept elsewhere; what is in it is the library's.
   ADCS_STATE_VERSION is its first word, by which a state of another export is known. */
#define ADCS_STATE_BYTES $state_bytes
#define ADCS_STATE_VERSION ${state_version}u
typedef struct {
    double aligned;
    unsigned char bytes[ADCS_STATE_BYTES - 8];
} adcs_state;

${precision}/* When to call it, and what the limits are. If ADCS_MEASURE_S is above 0, the coils are off for so
   long while sensors measure; wheels follow every command. */
$contract
$enums
/* What the computer is given at a control step: the latest readings with their times. */
typedef struct {
$inputs} adcs_inputs;

/* What it answers, in body axes: dipole of the coils [A m^2], torque on the body by wheels [N m].
   Both are finite, and what coils and wheels make of them is within their limits; a part along an
   axis that they lack is left as it is. Polarity of the coils and torques of single wheels are the
   drivers'. */
typedef struct {
    double dipole_a_m2[3];
    double torque_n_m[3];
} adcs_command;

/* What a step has met, bit by bit; 0: nothing to be said. */
$met
/* What becomes of a command from outside. */
typedef enum {
$outcomes} adcs_outcome;

/* The estimate: when it was made, attitude (body to inertial), rate and gyro bias in body axes,
   standard deviations of attitude and rate; NaN where there is none. */
typedef struct {
    double t_s;
    double q_body_to_inertial[4];
    double omega_body_rad_s[3];
    double gyro_bias_rad_s[3];
    double sigma_rad;
    double sigma_rad_s;
} adcs_estimate;

/* Whether a state that was kept elsewhere can be gone on with. */
typedef enum {
    ADCS_SOUND = 0, /* it is whole */
    ADCS_OF_ANOTHER_EXPORT = 1, /* it was not begun by adcs_init of this export */
    ADCS_NOT_SEALED = 2, /* it was changed after it was sealed, or never sealed */
    ADCS_DAMAGED = 3 /* its bits are not those that were sealed */
} adcs_integrity;

/* Telemetry in the units of the packets' dictionary; NaN: not known. */
typedef struct {
$telemetry} adcs_report;

/* Begin: parameters, memory and modes as at the start of the scenario. */
void adcs_init(adcs_state *state);

/* One control step; what it has met. A step with a time that is not finite, goes back or is far
   ahead is not taken: the command is zero. The second such step in a row is taken: time has passed,
   or the clock was set back, and the computer's own goes on from where it was. */
uint32_t adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command);

/* The clock from which times are handed in has been set forward by shift_s (back: below 0). The
   computer's own goes on as before: no estimate is lost. A clock of the state that an error of the
   memory has made no time at all, so that every step is refused or its readings are, begins again
   with the next step, whatever shift_s is; modes and parameters stay. Estimators that had times of
   it begin again by adcs_restart_estimators. */
adcs_outcome adcs_rebase(adcs_state *state, double shift_s);

/* How far the clock from which times are handed in is ahead of the computer's own [s]: by what
   adcs_rebase was told, and by steps of it that adcs_step has found. */
double adcs_clock_offset_s(const adcs_state *state);

/* Let the estimators begin again, as at the start. */
adcs_outcome adcs_restart_estimators(adcs_state *state);

/* Seal a state before it is kept elsewhere; whatever changes it breaks the seal. */
void adcs_seal_state(adcs_state *state);

/* Whether a state that comes back is as it was sealed. Begin with adcs_init where it is not. */
adcs_integrity adcs_check_state(const adcs_state *state);

/* Whether this build computes with the bits of the export: products, sums and quotients
   rounded one by one, no flushed zeros, NaN seen, words in the order of IEEE 754. */
bool adcs_self_test(void);

/* Version of torquer, mark of its sources, mark of the computer: which export this is. */
const char *adcs_fingerprint(void);

/* ADCS_INTERFACE_VERSION of the library. */
uint32_t adcs_interface_version(void);

/* Number of the state (ADCS_STATE_...) in which a region (ADCS_REGION_...) is; -1 for none. */
int32_t adcs_mode(const adcs_state *state, int32_t region);

/* Laws and estimators of the user's that have failed since adcs_init (bits ADCS_FAILED_...), as they
   would end a simulation: by an index that is not in its table, or by a division by zero. One that
   fails commands nothing, or estimates nothing, at that step, and is called again at the next;
   ADCS_MET_LAW_FAILED is said of that step alone. `line`: where in its Python file the latest
   failed, 0 for none. */
int64_t adcs_failures(const adcs_state *state, int64_t *line);

/* A logged value: the cell ADCS_LOG_... or one that follows it; NaN beyond the memory. */
double adcs_logged(const adcs_state *state, int32_t cell);

/* What a state of a region is called, by its number; "" for none. */
const char *adcs_mode_name(int32_t mode);

/* Whether a law (ADCS_LAW_...) works in the present modes. */
bool adcs_is_active(const adcs_state *state, int32_t law);

/* The estimator (ADCS_ESTIMATOR_...) that works in the present modes. */
int32_t adcs_estimator(const adcs_state *state);

/* Whether a region that only guards has left its first state. */
bool adcs_is_tripped(const adcs_state *state, int32_t region);

/* Telemetry of the last step, with what it was given and has answered. */
void adcs_telemetry(const adcs_state *state, const adcs_inputs *inputs,
    const adcs_command *command, adcs_report *out);

/* What the last step has met. */
uint32_t adcs_met(const adcs_state *state);

/* The estimate after the last step. */
adcs_estimate adcs_estimated(const adcs_state *state);

/* Have a region enter one of its states at the next step, as a transition would; the state that
   waits for that step (ADCS_STATE_...), -1 for none. */
adcs_outcome adcs_command_mode(adcs_state *state, int32_t region, int32_t mode);
int32_t adcs_commanded_mode(const adcs_state *state, int32_t region);

/* Keep the transitions of a region from firing, or let them again; whether they are kept. */
adcs_outcome adcs_hold(adcs_state *state, int32_t region, bool on);
bool adcs_is_held(const adcs_state *state, int32_t region);

/* Raise or lower a flag (ADCS_FLAG_...) from the next step on; whether it is raised. */
adcs_outcome adcs_set_flag(adcs_state *state, int32_t flag, bool on);
bool adcs_flag(const adcs_state *state, int32_t flag);

/* Set a number of a parameter (ADCS_PARAMETER_... and those that follow it), SI; what it is, NaN
   beyond the parameters. Its limits stand beside its name: those of the key of the scenario of
   which it is the value, else those that the law or estimator declares; where there are none, why
   any finite number is taken. */
adcs_outcome adcs_set_parameter(adcs_state *state, int32_t place, double value);
double adcs_parameter(const adcs_state *state, int32_t place);

#ifdef __cplusplus
}
#endif

#endif
