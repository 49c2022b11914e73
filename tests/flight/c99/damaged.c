/* A recorded flight whose state is damaged: damaged recorded.bin CASES.

   Whatever a state holds, no function leaves its tables, none goes on for ever, and a command is
   finite. `calls.h`, made from the header, calls every function that takes a state: `look` those
   that only read it, `set` those that change it, with what the first that answers otherwise than
   expected is called. */
#include "adcs.h"
#include "calls.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))
#define WORDS (sizeof(adcs_state) / sizeof(double))
#define STEPS 40u
#define HEAD 2u /* words before what a state holds: version and seal */

static adcs_inputs flight[STEPS];
static uint64_t word = UINT64_C(0x9e3779b97f4a7c15);

static uint64_t drawn(uint64_t below)
{
    word ^= word << 13;
    word ^= word >> 7;
    word ^= word << 17;
    return word % below;
}

static bool is_finite(const adcs_command *command)
{
    bool finite = true;
    for (size_t k = 0; k < 3u; k++) {
        finite = finite && isfinite(command->dipole_a_m2[k]) && isfinite(command->torque_n_m[k]);
    }
    return finite;
}

static bool is_read(const char *name)
{
    FILE *file = fopen(name, "rb");
    uint64_t head[4];
    bool done = file != NULL && fread(head, sizeof head, 1, file) == 1 && head[2] == INPUTS;
    for (size_t step = 0; done && step < STEPS; step++) {
        double rest[15];
        done = fread(rest, sizeof(double), 1, file) == 1 &&
            fread(&flight[step], sizeof flight[step], 1, file) == 1 &&
            fread(&rest[1], sizeof(double), 14, file) == 14;
    }
    return file != NULL && fclose(file) == 0 && done;
}

/* What was not begun says so to whatever would change it, and stays as it is. */
static const char *not_begun(adcs_state *state)
{
    const adcs_state before = *state;
    adcs_command command = {{1.0, 1.0, 1.0}, {1.0, 1.0, 1.0}};
    const char *name = set(state, ADCS_NOT_BEGUN);
    look(state, &flight[0], &command);
    if (name != NULL) {
        return name;
    }
    if (adcs_step(state, &flight[0], &command) != ADCS_MET_NOT_BEGUN || !is_finite(&command)) {
        return "adcs_step";
    }
    if (adcs_met(state) != ADCS_MET_NOT_BEGUN) {
        return "adcs_met";
    }
    if (adcs_check_state(state) != ADCS_OF_ANOTHER_EXPORT) {
        return "adcs_check_state";
    }
    return (memcmp(&before, state, sizeof before) == 0) ? NULL : "the state";
}

static bool is_flown_on(adcs_state *state)
{
    bool good = true;
    for (size_t step = 10; step < 14u; step++) {
        adcs_command command;
        (void)adcs_step(state, &flight[step], &command);
        look(state, &flight[step], &command);
        good = good && is_finite(&command);
        if (step == 12u) {
            (void)set(state, ADCS_DONE);
        }
    }
    return good;
}

/* Put numbers that none of a state's can be into some of its words. */
static void damage(double *words, uint64_t count)
{
    static const double any[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, -1.0, 7.0, 1e6, 1e18,
        -1e18, 9.3e18, 4e9, 0.5, -0.0, 5e-324, 1.0};
    for (uint64_t k = 0; k < count; k++) {
        words[HEAD + drawn(WORDS - HEAD)] = any[drawn(sizeof any / sizeof any[0])];
    }
}

int main(int count, char **arguments)
{
    static adcs_state state;
    static adcs_state flown;
    static double words[WORDS];
    unsigned long most = 0;
    if (count < 3 || sscanf(arguments[2], "%lu", &most) != 1 || !is_read(arguments[1])) {
        printf("usage: damaged recorded.bin CASES, with a record of %u steps\n", STEPS);
        return 2;
    }
    for (int filled = 0; filled < 256; filled += 5) {
        const char *name;
        (void)alarm(30); /* what never ends, ends so */
        memset(&state, filled, sizeof state);
        name = not_begun(&state);
        if (name != NULL) {
            printf("filled with %d: %s\n", filled, name);
            return 1;
        }
    }
    adcs_init(&flown);
    for (size_t step = 0; step < 10u; step++) {
        adcs_command command;
        (void)adcs_step(&flown, &flight[step], &command);
    }
    for (unsigned long number = 0; number < most; number++) {
        (void)alarm(30);
        memcpy(words, &flown, sizeof words);
        if (number < 256u) {
            memset(&words[HEAD], (int)number, sizeof words - (HEAD * sizeof words[0]));
        } else {
            damage(words, 1u + drawn(8));
        }
        memcpy(&state, words, sizeof state);
        if (!is_flown_on(&state)) {
            printf("case %lu: a command is not finite\n", number);
            return 1;
        }
    }
    printf("%lu damaged states\n", most);
    return 0;
}
