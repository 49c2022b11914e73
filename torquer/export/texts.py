"""Texts of the files of an export, with places for what differs between computers."""

HEADER = """\
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

/* Whether this build computes with the bits of the export: no fused products, no flushed zeros. */
bool adcs_self_test(void);

/* Version of torquer, mark of its sources, mark of the computer: which export this is. */
const char *adcs_fingerprint(void);

/* Number of the state (ADCS_STATE_...) in which a region (ADCS_REGION_...) is; -1 for none. */
int32_t adcs_mode(const adcs_state *state, int32_t region);

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
"""

TYPES = """\
/* Types of the kernels; those of memory are places in the state. */
#ifndef ADCS_TYPES_H
#define ADCS_TYPES_H

$includes
$types
/* Constants of the computer. */
const $computer *adcs_constants(void);

#endif
"""

SOURCE = """\
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
"""

#: What differs in single precision.
PRECISION = """\
/* Kernels compute in single precision, but for times; interface and memory hold doubles. */

"""
SINGLE_TEST = """\
/* Whether floats have their bits, too. */
static bool is_single_exact(void)
{
    volatile float a = 1.0f + 0x1p-12f;
    volatile float b = -(1.0f + 0x1p-11f);
    volatile float least = 0x1p-149f;
    const float x = a;
    const float y = b;
    return x * x + y == 0.0f && least * 1.0f > 0.0f && sizeof(float) == 4u;
}

"""

TABLES = """\
/* Parameters, mode tables and first state of the on-board computer of $name. */
#include "adcs.h"

$constants
const $computer *adcs_constants(void)
{
    return &constants;
}

$first
const char *adcs_fingerprint(void)
{
    return "$fingerprint";
}

void adcs_init(adcs_state *state)
{
    *state = first;
}
"""

CMAKE = """\
cmake_minimum_required(VERSION 3.10)
project(adcs C)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)

# no product is fused into a sum: the bits would be others
add_compile_options(-ffp-contract=off -pedantic -Wall -Wextra -Wconversion)
add_compile_options(-Wdouble-promotion -Wshadow)
add_library(adcs adcs.c adcs_tables.c adcs_math.c)
option(ADCS_PORTABLE "sin, cos, atan2 and their like of adcs_math.c in place of the library's" OFF)
if(ADCS_PORTABLE)
    target_compile_definitions(adcs PRIVATE ADCS_PORTABLE)
endif()
target_include_directories(adcs PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
target_link_libraries(adcs PUBLIC m)

# for torquer run SCENARIO --computer build/libadcs_in_the_loop.so
add_library(adcs_in_the_loop SHARED adcs.c adcs_tables.c adcs_math.c test/in_the_loop.c)
target_include_directories(adcs_in_the_loop PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_link_libraries(adcs_in_the_loop PRIVATE m)

enable_testing()
add_executable(replay test/replay.c)
target_link_libraries(replay PRIVATE adcs)
add_test(NAME replay COMMAND replay ${CMAKE_CURRENT_SOURCE_DIR}/test/recorded.bin)
"""

MAKEFILE = """\
pil:
\tpython3 test/pil.py

misra:
\tpython3 test/misra.py

.PHONY: pil misra
"""

REPLAY = """\
/* Replay recorded control steps and compare every bit: replay recorded.bin
   replay recorded.bin OUT: the same inputs, with the answers of this build in place of the recorded

   A step in the file: 1.0 if the computer began anew before it, the inputs, the command, the
   estimate (attitude, rate), a mark of the whole state. A number that is not one has one mark,
   whatever its bits. */
#include "adcs.h"

#include <stdio.h>
#include <string.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))
#define ESTIMATE 7u
#define NUMBERS (sizeof(adcs_state) / sizeof(double))

typedef struct {
    char magic[8];
    uint64_t steps;
    uint64_t inputs;
    uint64_t numbers;
} head_of_file;

static uint64_t bits_of(double number)
{
    uint64_t bits;
    if (isnan(number)) {
        return UINT64_C(0x7ff8000000000000);
    }
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

/* FNV-1a over words of 64 bits. */
static uint64_t mark_of(const adcs_state *state)
{
    static double numbers[NUMBERS];
    uint64_t mark = UINT64_C(0xcbf29ce484222325);
    memcpy(numbers, state, sizeof numbers);
    for (size_t k = 0; k < NUMBERS; k++) {
        mark = (mark ^ bits_of(numbers[k])) * UINT64_C(0x100000001b3);
    }
    return mark;
}

static bool is_same_command(const adcs_command *command, const double *recorded)
{
    bool same = true;
    for (size_t k = 0; k < 3; k++) {
        same = same && bits_of(command->dipole_a_m2[k]) == bits_of(recorded[k]);
        same = same && bits_of(command->torque_n_m[k]) == bits_of(recorded[3 + k]);
    }
    return same;
}

#ifdef ADCS_AROUND_STEP
void adcs_before_step(void);
void adcs_after_step(void);
#else
#define adcs_before_step()
#define adcs_after_step()
#endif

static bool is_written(FILE *out, double anew, const adcs_inputs *inputs,
    const adcs_command *command, const adcs_state *state)
{
    const Known *known = &state->known[0];
    const double estimate[ESTIMATE] = {known->estimate_q_x, known->estimate_q_y,
        known->estimate_q_z, known->estimate_q_w, known->estimate_omega_x, known->estimate_omega_y,
        known->estimate_omega_z};
    const uint64_t mark = mark_of(state);
    return fwrite(&anew, sizeof anew, 1, out) == 1 && fwrite(inputs, sizeof *inputs, 1, out) == 1 &&
        fwrite(command, sizeof *command, 1, out) == 1 &&
        fwrite(estimate, sizeof estimate, 1, out) == 1 && fwrite(&mark, sizeof mark, 1, out) == 1;
}

/* Number of steps that are the same; `step` becomes the first that is not. With `out`, answers are
   written and not compared. */
static uint64_t replayed(FILE *file, FILE *out, const head_of_file *head, uint64_t *step)
{
    static adcs_state state;
    uint64_t same = 0;
    adcs_init(&state);
    for (*step = 0; *step < head->steps; (*step)++) {
        double anew;
        double recorded[6u + ESTIMATE];
        uint64_t mark;
        adcs_inputs inputs;
        adcs_command command;
        if (fread(&anew, sizeof anew, 1, file) != 1 ||
            fread(&inputs, sizeof inputs, 1, file) != 1 ||
            fread(recorded, sizeof recorded, 1, file) != 1 ||
            fread(&mark, sizeof mark, 1, file) != 1) {
            break;
        }
        if (anew > 0.0) {
            adcs_init(&state);
        }
        adcs_before_step();
        adcs_step(&state, &inputs, &command);
        adcs_after_step();
        if (out != NULL) {
            if (!is_written(out, anew, &inputs, &command, &state)) {
                break;
            }
        } else if (!is_same_command(&command, recorded) || mark_of(&state) != mark) {
            break;
        }
        same++;
    }
    return same;
}

int main(int count, char **arguments)
{
    head_of_file head;
    uint64_t step = 0;
    uint64_t same;
    FILE *file = (count > 1) ? fopen(arguments[1], "rb") : NULL;
    FILE *out = (count > 2) ? fopen(arguments[2], "wb") : NULL;
    if (!adcs_self_test()) {
        printf("this build computes otherwise: compile with -ffp-contract=off\\n");
        return 2;
    }
    if (file == NULL || fread(&head, sizeof head, 1, file) != 1) {
        printf("usage: replay recorded.bin\\n");
        return 2;
    }
    if (memcmp(head.magic, "ADCSREC2", 8) != 0 || head.inputs != INPUTS ||
        head.numbers != NUMBERS) {
        printf("the record is of another export\\n");
        (void)fclose(file);
        return 2;
    }
    if (count > 2 && (out == NULL || fwrite(&head, sizeof head, 1, out) != 1)) {
        printf("%s cannot be written\\n", arguments[2]);
        (void)fclose(file);
        return 2;
    }
    same = replayed(file, out, &head, &step);
    (void)fclose(file);
    if (out != NULL && fclose(out) != 0) {
        same = 0;
    }
    if (same != head.steps) {
        printf("the first difference is at step %lu of %lu\\n", (unsigned long)step,
            (unsigned long)head.steps);
        return 1;
    }
    printf("%lu control steps: %s\\n", (unsigned long)same,
        (count > 2) ? "written" : "the same bits in commands and state");
    return 0;
}
"""

MATH_HEADER = """\
/* Functions of angles whose bits are the same with every C library, for builds with ADCS_PORTABLE:
   the double nearest to the true value, but for about one argument in 10^8 or more. */
#ifndef ADCS_MATH_H
#define ADCS_MATH_H

$prototypes
#endif
"""

MATH = """\
/* Functions of angles, the same bits with every C library; exported by torquer $version. */
#include "adcs_math.h"

$includes
$program"""
