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
