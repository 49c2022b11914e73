/* Replay recorded control steps and compare every bit: replay recorded.bin
   replay recorded.bin OUT: the same inputs, with the answers of this build in place of the recorded
   With ADCS_RECORDED defined the first steps are those of test/recorded.c, for boards without files.

   A record is words of 64 bits, the lowest byte first on whatever processor. A step in the file:
   1.0 if the computer began anew before it, the inputs, the command, the estimate (attitude,
   rate), a mark of the whole state. A number that is not one has one mark, whatever its bits.
   After the steps come instants of the ephemeris on board, if there is one: how many, then for
   each its time, position and velocity (zeros unless they are given), and all that is worked out
   from them. */
#include "adcs.h"

#include <stdio.h>
#include <string.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))
#define ESTIMATE 7u
#define NUMBERS (sizeof(((adcs_state *)0)->board) / sizeof(double))

typedef struct {
    uint64_t magic;
    uint64_t steps;
    uint64_t inputs;
    uint64_t numbers;
} head_of_file;

/* A word by its eight bytes, the lowest first. */
static uint64_t word_of(const uint8_t *bytes)
{
    uint64_t word = 0;
    for (unsigned k = 0; k < 8u; k++) {
        word |= (uint64_t)bytes[k] << (8u * k);
    }
    return word;
}

#ifdef ADCS_RECORDED
extern const uint64_t adcs_recorded[];
extern const size_t adcs_recorded_words;

#define IS_AT_HAND true

static bool is_word_read(FILE *file, uint64_t *word)
{
    static size_t place;
    (void)file;
    if (place >= adcs_recorded_words) {
        return false;
    }
    *word = adcs_recorded[place];
    place++;
    return true;
}
#else
#define IS_AT_HAND false

static bool is_word_read(FILE *file, uint64_t *word)
{
    uint8_t bytes[8];
    if (fread(bytes, 1, sizeof bytes, file) != sizeof bytes) {
        return false;
    }
    *word = word_of(bytes);
    return true;
}
#endif

static bool is_word_written(FILE *file, uint64_t word)
{
    uint8_t bytes[8];
    for (unsigned k = 0; k < 8u; k++) {
        bytes[k] = (uint8_t)((word >> (8u * k)) & 0xffu);
    }
    return fwrite(bytes, 1, sizeof bytes, file) == sizeof bytes;
}

/* Numbers into a place that holds doubles alone. */
static bool are_read(FILE *file, void *numbers, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        uint64_t word;
        if (!is_word_read(file, &word)) {
            return false;
        }
        memcpy((uint8_t *)numbers + (k * sizeof word), &word, sizeof word);
    }
    return true;
}

static bool are_written(FILE *file, const void *numbers, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        uint64_t word;
        memcpy(&word, (const uint8_t *)numbers + (k * sizeof word), sizeof word);
        if (!is_word_written(file, word)) {
            return false;
        }
    }
    return true;
}

static bool is_head_read(FILE *file, head_of_file *head)
{
    return is_word_read(file, &head->magic) && is_word_read(file, &head->steps) &&
        is_word_read(file, &head->inputs) && is_word_read(file, &head->numbers);
}

static bool is_head_written(FILE *file, const head_of_file *head)
{
    return is_word_written(file, head->magic) && is_word_written(file, head->steps) &&
        is_word_written(file, head->inputs) && is_word_written(file, head->numbers);
}

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
    memcpy(numbers, &state->board, sizeof numbers);
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
void adcs_after_step(uint32_t part);
#else
#define adcs_before_step()
#define adcs_after_step(part)
#endif

static bool is_written(FILE *out, double anew, const adcs_inputs *inputs,
    const adcs_command *command, const adcs_state *state)
{
    const adcs_estimate now = adcs_estimated(state);
    const double estimate[ESTIMATE] = {now.q_body_to_inertial[0], now.q_body_to_inertial[1],
        now.q_body_to_inertial[2], now.q_body_to_inertial[3], now.omega_body_rad_s[0],
        now.omega_body_rad_s[1], now.omega_body_rad_s[2]};
    const uint64_t mark = mark_of(state);
    return are_written(out, &anew, 1) && are_written(out, inputs, INPUTS) &&
        are_written(out, command, 6) && are_written(out, estimate, ESTIMATE) &&
        is_word_written(out, mark);
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
        if (!are_read(file, &anew, 1) || !are_read(file, &inputs, INPUTS) ||
            !are_read(file, recorded, 6u + ESTIMATE) || !is_word_read(file, &mark)) {
            break;
        }
        if (anew > 0.0) {
            adcs_init(&state);
        }
        adcs_before_step();
        (void)adcs_step(&state, &inputs, &command);
        adcs_after_step(0);
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

#ifdef ADCS_EPHEMERIS_H
#define POSITION (offsetof(adcs_inputs, r_inertial_m) / sizeof(double))

/* Time, place, and what is found there; the members of the inputs from the position on are these. */
typedef struct {
    double t_s;
    double place[6];
    double found[16];
} instant;

/* Whether all instants are the same, or with `out` written; says so. */
static bool are_instants_the_same(FILE *file, FILE *out)
{
    static adcs_elements elements;
    uint64_t count = 0;
    uint64_t same = 0;
    instant recorded;
    adcs_first_elements(&elements);
    if (!is_word_read(file, &count) || (out != NULL && !is_word_written(out, count))) {
        return false;
    }
    while (same < count && are_read(file, &recorded, sizeof recorded / sizeof(double))) {
        adcs_inputs inputs = {0};
        double *const place = (double *)(void *)&inputs + POSITION;
        instant now = recorded;
        bool is_same = true;
        inputs.t_s = recorded.t_s;
        memcpy(place, recorded.place, sizeof recorded.place);
        adcs_before_step();
        (void)adcs_ephemeris(&elements, &inputs);
        adcs_after_step(1);
        memcpy(now.found, place, sizeof now.found);
        for (size_t k = 0; k < 16u; k++) {
            is_same = is_same && bits_of(now.found[k]) == bits_of(recorded.found[k]);
        }
        if ((out != NULL) ? !are_written(out, &now, sizeof now / sizeof(double)) : !is_same) {
            break;
        }
        same++;
    }
    if (same != count) {
        printf("the first difference is at instant %lu of %lu of the ephemeris\n",
            (unsigned long)same, (unsigned long)count);
        return false;
    }
    printf("%lu instants of the ephemeris: %s\n", (unsigned long)same,
        (out != NULL) ? "written" : "the same bits");
    return true;
}
#else
static bool are_instants_the_same(FILE *file, FILE *out)
{
    (void)file;
    (void)out;
    return true;
}
#endif

static void close_file(FILE *file)
{
    if (file != NULL) {
        (void)fclose(file);
    }
}

int main(int count, char **arguments)
{
    bool same_instants;
    head_of_file head;
    uint64_t step = 0;
    uint64_t same;
    FILE *file = (count > 1) ? fopen(arguments[1], "rb") : NULL;
    FILE *out = (count > 2) ? fopen(arguments[2], "wb") : NULL;
    if (!adcs_self_test()) {
        printf("this build computes otherwise: compile with -ffp-contract=off\n");
        return 2;
    }
    if ((file == NULL && !IS_AT_HAND) || !is_head_read(file, &head)) {
        printf("usage: replay recorded.bin\n");
        return 2;
    }
    if (head.magic != word_of((const uint8_t *)"ADCSREC2") || head.inputs != INPUTS ||
        head.numbers != NUMBERS) {
        printf("the record is of another export\n");
        close_file(file);
        return 2;
    }
    if (count > 2 && (out == NULL || !is_head_written(out, &head))) {
        printf("%s cannot be written\n", arguments[2]);
        close_file(file);
        return 2;
    }
    same = replayed(file, out, &head, &step);
    if (same == head.steps) {
        printf("%lu control steps: %s\n", (unsigned long)same,
            (count > 2) ? "written" : "the same bits in commands and state");
    }
    same_instants = same == head.steps && are_instants_the_same(file, out);
    close_file(file);
    if (out != NULL && fclose(out) != 0) {
        same = 0;
    }
    if (same != head.steps) {
        printf("the first difference is at step %lu of %lu\n", (unsigned long)step,
            (unsigned long)head.steps);
    }
    return (same == head.steps && same_instants) ? 0 : 1;
}
