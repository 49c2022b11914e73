/* Replay recorded control steps and compare every bit: replay recorded.bin
   replay recorded.bin OUT: the same inputs, with the answers of this build in place of the recorded

   A step in the file: 1.0 if the computer began anew before it, the inputs, the command, the
   estimate (attitude, rate), a mark of the whole state. A number that is not one has one mark,
   whatever its bits. After the steps come instants of the ephemeris on board, if there is one:
   how many, then for each its time, position and velocity (zeros unless they are given), and all
   that is worked out from them. */
#include "adcs.h"

#include <stdio.h>
#include <string.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))
#define ESTIMATE 7u
#define NUMBERS (sizeof(((adcs_state *)0)->board) / sizeof(double))

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
    const Known *known = &state->board.known[0];
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
    if (fread(&count, sizeof count, 1, file) != 1 ||
        (out != NULL && fwrite(&count, sizeof count, 1, out) != 1)) {
        return false;
    }
    while (same < count && fread(&recorded, sizeof recorded, 1, file) == 1) {
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
        if ((out != NULL) ? fwrite(&now, sizeof now, 1, out) != 1 : !is_same) {
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
    if (file == NULL || fread(&head, sizeof head, 1, file) != 1) {
        printf("usage: replay recorded.bin\n");
        return 2;
    }
    if (memcmp(head.magic, "ADCSREC2", 8) != 0 || head.inputs != INPUTS ||
        head.numbers != NUMBERS) {
        printf("the record is of another export\n");
        (void)fclose(file);
        return 2;
    }
    if (count > 2 && (out == NULL || fwrite(&head, sizeof head, 1, out) != 1)) {
        printf("%s cannot be written\n", arguments[2]);
        (void)fclose(file);
        return 2;
    }
    same = replayed(file, out, &head, &step);
    if (same == head.steps) {
        printf("%lu control steps: %s\n", (unsigned long)same,
            (count > 2) ? "written" : "the same bits in commands and state");
    }
    same_instants = same == head.steps && are_instants_the_same(file, out);
    (void)fclose(file);
    if (out != NULL && fclose(out) != 0) {
        same = 0;
    }
    if (same != head.steps) {
        printf("the first difference is at step %lu of %lu\n", (unsigned long)step,
            (unsigned long)head.steps);
    }
    return (same == head.steps && same_instants) ? 0 : 1;
}
