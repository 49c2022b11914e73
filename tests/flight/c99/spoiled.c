/* A recorded flight with spoiled inputs, again and again: spoiled recorded.bin CASES.

   Ten ways to spoil a stretch of up to 20 steps, each in so many cases with seeds of their own. In
   every step the command must be finite and within the limits of coils and wheels, five steps after
   the stretch nothing may be refused any more, and in the last steps the command must go on changing
   where that of the sound flight does, unless a guard has switched the laws off. Prints the cases
   and the share of them whose last command is that of the sound flight. */
#include "adcs.h"
#include "limits.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))
#ifndef STEPS
#define STEPS 150u
#endif
#define LAST 20u
#define WAYS 10u
#define REFUSED (ADCS_MET_TIME_NOT_FINITE | ADCS_MET_TIME_BACK | ADCS_MET_TIME_AHEAD | \
    ADCS_MET_READING_NOT_IN_ORDER)

static double sound[STEPS][INPUTS];
static adcs_command expected[STEPS];
static uint64_t word;

static uint64_t drawn(uint64_t below)
{
    word ^= word << 13;
    word ^= word >> 7;
    word ^= word << 17;
    return word % below;
}

static double one_of(const double *values, size_t count)
{
    return values[drawn(count)];
}

/* Put some of these values into some of the inputs. */
static void put_some(double *row, const double *values, size_t count)
{
    for (uint64_t k = drawn(7) + 1u; k > 0u; k--) {
        row[drawn(INPUTS)] = one_of(values, count);
    }
}

static void spoil(unsigned way, double *row)
{
    static const double none[] = {NAN, -NAN}, endless[] = {INFINITY, -INFINITY};
    static const double large[] = {1e300, -1e300, 1e20, -1e9};
    static const double small[] = {5e-324, -2e-308, 0.0, -0.0};
    static const double any[] = {NAN, INFINITY, -INFINITY, 1e300, 0.0};
    static const double jumps[] = {-1e5, -10.0, 10.0, 1e5, 1e9};
    static const double shifts[] = {-1e5, -1.0, 1.0, 1e5};
    const double other = one_of(any, 5);
    const double shift = one_of(shifts, 4);
    uint64_t bits;
    switch (way) {
    case 0: put_some(row, none, 2); break;
    case 1: put_some(row, endless, 2); break;
    case 2: put_some(row, large, 4); break;
    case 3: put_some(row, small, 4); break;
    case 4:
        for (size_t k = 0; k < INPUTS; k++) {
            row[k] = other;
        }
        break;
    case 5:
        for (double *const at = &row[drawn(INPUTS)];;) {
            memcpy(&bits, at, sizeof bits);
            bits ^= UINT64_C(1) << drawn(64);
            memcpy(at, &bits, sizeof bits);
            break;
        }
        break;
    case 6: row[0] += one_of(jumps, 5); break;
    case 7:
        for (size_t k = 0; k < times; k++) {
            row[first_time + k] += shift;
        }
        break;
    case 8:
        for (size_t k = INPUTS - 1u; k > 1u; k--) {
            const size_t with = 1u + (size_t)drawn(k);
            const double kept = row[k];
            row[k] = row[with];
            row[with] = kept;
        }
        break;
    default: memcpy(row, sound[drawn(STEPS)], sizeof sound[0]); break; /* of another time */
    }
}

static bool is_within(const double limits[][3], size_t count, const double *v)
{
    bool within = true;
    for (size_t k = 0; k < count; k++) {
        const double *n = limits[k];
        within = within && fabs((n[0] * v[0]) + (n[1] * v[1]) + (n[2] * v[2])) <= 1.0;
    }
    return within;
}

/* Whether a command is finite and within all limits. */
static bool is_good(const adcs_command *command)
{
    bool good = true;
    for (size_t k = 0; k < 3u; k++) {
        good = good && isfinite(command->dipole_a_m2[k]) && isfinite(command->torque_n_m[k]);
    }
    return good && is_within(of_dipole, sizeof of_dipole / sizeof of_dipole[0],
        command->dipole_a_m2) &&
        is_within(of_torque, sizeof of_torque / sizeof of_torque[0], command->torque_n_m);
}

static bool is_same(const adcs_command *a, const adcs_command *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* Fly with a spoiled stretch; whether all is well. `after`: the last command; `what`: what is not. */
static bool is_flown(unsigned way, uint64_t seed, adcs_command *after, const char **what)
{
    static adcs_state state;
    adcs_command before = {0};
    bool changes = false;
    bool should = false;
    uint32_t guarded = 0;
    uint64_t from;
    uint64_t to;
    word = (seed + 1u) * UINT64_C(0x9e3779b97f4a7c15) + way;
    from = 20u + drawn(40);
    to = from + 1u + drawn(20);
    adcs_init(&state);
    for (uint64_t step = 0; step < STEPS; step++) {
        double row[INPUTS];
        adcs_inputs inputs;
        uint32_t met;
        memcpy(row, sound[step], sizeof row);
        if (step >= from && step < to) {
            spoil(way, row);
        }
        memcpy(&inputs, row, sizeof inputs);
        met = adcs_step(&state, &inputs, after);
        if (!is_good(after)) {
            *what = "a command is not finite or beyond limits";
            return false;
        }
        if (step >= to + 5u && (met & REFUSED) != 0u) {
            *what = "a sound step is refused";
            return false;
        }
        if (step > STEPS - LAST) {
            changes = changes || !is_same(after, &before);
            should = should || !is_same(&expected[step], &expected[step - 1u]);
            guarded |= met & ADCS_MET_GUARDED;
        }
        before = *after;
    }
    *what = "the command does not change any more";
    return changes || !should || guarded != 0u;
}

/* The sound flight: inputs by the record, commands by this build. */
static bool is_read(const char *name)
{
    static adcs_state state;
    FILE *file = fopen(name, "rb");
    uint64_t head[4];
    bool done = file != NULL && fread(head, sizeof head, 1, file) == 1 && head[2] == INPUTS;
    adcs_init(&state);
    for (size_t step = 0; done && step < STEPS; step++) {
        double rest[15];
        adcs_inputs inputs;
        done = fread(rest, sizeof(double), 1, file) == 1 &&
            fread(sound[step], sizeof sound[step], 1, file) == 1 &&
            fread(&rest[1], sizeof(double), 14, file) == 14;
        memcpy(&inputs, sound[step], sizeof inputs);
        (void)adcs_step(&state, &inputs, &expected[step]);
    }
    return file != NULL && fclose(file) == 0 && done;
}

int main(int count, char **arguments)
{
    unsigned long cases = 0;
    unsigned long same = 0;
    unsigned long most = 0;
    if (count < 3 || sscanf(arguments[2], "%lu", &most) != 1 || !is_read(arguments[1])) {
        printf("usage: spoiled recorded.bin CASES, with a record of %u steps\n", STEPS);
        return 2;
    }
    for (unsigned way = 0; way < WAYS; way++) {
        for (unsigned long seed = 0; seed < most; seed++) {
            adcs_command after;
            const char *what;
            if (!is_flown(way, seed, &after, &what)) {
                printf("way %u, case %lu: %s\n", way, seed, what);
                return 1;
            }
            cases++;
            same += is_same(&after, &expected[STEPS - 1u]);
        }
    }
    printf("%lu cases; %lu end with the command of the sound flight\n", cases, same);
    return 0;
}
