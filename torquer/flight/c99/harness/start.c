/* Start of the replay on QEMU's mps2 boards: vectors, floating point, files of the host by
   semihosting. Counts instructions by the board's timer and the stack of a step by painting it. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#define TIMER ((volatile uint32_t *)0x40000000u) /* 0: control, 1: value, counting down, 2: reload */
#define FLOATING_POINT ((volatile uint32_t *)0xE000ED88u)
#define PAINTED 16384u
#define PAINT 0xA5A5A5A5u

int main(int count, char **arguments);
void initialise_monitor_handles(void);
void reset(void);
void _init(void);
void _fini(void);
void adcs_before_step(void);
void adcs_after_step(uint32_t part);
void stack_top(void); /* an address of target.ld, not a function */

__attribute__((section(".vectors"), used)) void (*const vectors[])(void) = {
    stack_top, reset, abort, abort, abort, abort, abort};

/* What is measured of control steps and of the ephemeris on board. */
typedef struct {
    uint32_t most;
    uint32_t deepest;
    uint64_t total;
    uint64_t calls;
} measured;

static volatile uint32_t *base;
static uint32_t began;
static measured parts[2];

void _init(void)
{
}

void _fini(void)
{
}

static volatile uint32_t *stack_pointer(void)
{
    uint32_t at;
    __asm volatile("mov %0, sp" : "=r"(at));
    return (volatile uint32_t *)at;
}

__attribute__((noinline)) void adcs_before_step(void)
{
    base = stack_pointer();
    for (uint32_t k = 16; k < PAINTED; k++) {
        base[-(int32_t)k] = PAINT;
    }
    began = TIMER[1];
}

__attribute__((noinline)) void adcs_after_step(uint32_t part)
{
    const uint32_t ticks = began - TIMER[1];
    measured *now = &parts[part];
    uint32_t used = PAINTED - 1u;
    while (used > 16u && base[-(int32_t)used] == PAINT) {
        used--;
    }
    now->most = (ticks > now->most) ? ticks : now->most;
    now->deepest = (used > now->deepest) ? used : now->deepest;
    now->total += ticks;
    now->calls++;
}

void reset(void)
{
    static char program[] = "replay";
    static char record[] = "answers.bin";
    char *arguments[] = {program, record, NULL};
    int code;
    *FLOATING_POINT |= 0xFu << 20;
    __asm volatile("dsb\n\tisb");
    initialise_monitor_handles();
    TIMER[2] = 0xFFFFFFFFu;
    TIMER[1] = 0xFFFFFFFFu;
    TIMER[0] = 1u;
    code = main(2, arguments);
    for (const measured *each = parts; each < parts + 2; each++) {
        if (each->calls > 0u) {
            printf("ticks %lu %lu stack %lu\n", (unsigned long)(each->total / each->calls),
                (unsigned long)each->most, 4ul * (unsigned long)each->deepest);
        }
    }
    exit(code);
}
