/* The recorded control steps of an export, for the harnesses of the stubs: see test/replay.c. */
#ifndef RECORD_H
#define RECORD_H

#include "adcs.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define INPUTS (sizeof(adcs_inputs) / sizeof(double))

typedef struct {
    double anew;
    adcs_inputs inputs;
    double command[6];
    double estimate[7];
    uint64_t mark;
} recorded_step;

static inline bool is_same(double a, double b)
{
    return (isnan(a) && isnan(b)) || memcmp(&a, &b, sizeof a) == 0;
}

/* The file behind its head; NULL, with a word, if it is of another export. */
static inline FILE *opened_record(const char *name, uint64_t *steps)
{
    uint64_t head[4];
    FILE *file = fopen(name, "rb");
    if (file == NULL || fread(head, sizeof head, 1, file) != 1 || head[2] != INPUTS) {
        printf("no record of this export\n");
        return NULL;
    }
    *steps = head[1];
    return file;
}

static inline bool is_step_read(FILE *file, recorded_step *step)
{
    return fread(&step->anew, sizeof(double), 1, file) == 1 &&
        fread(&step->inputs, sizeof step->inputs, 1, file) == 1 &&
        fread(step->command, sizeof step->command, 1, file) == 1 &&
        fread(step->estimate, sizeof step->estimate, 1, file) == 1 &&
        fread(&step->mark, sizeof step->mark, 1, file) == 1;
}

static inline bool are_same(const double *a, const double *b, size_t count)
{
    bool same = true;
    for (size_t k = 0; k < count; k++) {
        same = same && is_same(a[k], b[k]);
    }
    return same;
}

/* Says how many steps had the same bits; the exit status. */
static inline int said(uint64_t same, uint64_t steps)
{
    printf("%lu of %lu steps: the same bits\n", (unsigned long)same, (unsigned long)steps);
    return (same == steps) ? 0 : 1;
}

#endif
