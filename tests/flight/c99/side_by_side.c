/* Two computers in one image, beside names that other libraries have: each flies its own record. */
#include "bus.h"
#include "nav.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

typedef struct { float x, y, z; } vec3; /* as in any maths library */
typedef struct { float m[3][3]; } mat3;
typedef enum { IDLE, ACTIVE } State; /* as in any application */
typedef struct { int known; } Known;
typedef vec3 Command, Region, Action, Gate, Board, Answer, Held, OnBoard, Computer, ModeTable;

#ifdef __cplusplus
extern "C" {
#endif
extern const uint64_t bus_recorded[];
extern const uint64_t nav_recorded[];
#ifdef __cplusplus
}
#endif

#define COMPUTER(name, NAME)                                                                  \
    static name##_state name##_now;                                                           \
    static size_t name##_at = 4;                                                              \
    static bool name##_flies(void)                                                            \
    {                                                                                         \
        const uint64_t *row = &name##_recorded[name##_at];                                    \
        const size_t inputs = (size_t)name##_recorded[2];                                     \
        name##_inputs given;                                                                  \
        name##_command command;                                                               \
        name##_report report;                                                                 \
        if (inputs * 8u != sizeof given || (row[0] != 0u)) {                                  \
            return false;                                                                     \
        }                                                                                     \
        memcpy(&given, &row[1], sizeof given);                                                \
        (void)name##_step(&name##_now, &given, &command);                                     \
        name##_telemetry(&name##_now, &given, &command, &report);                             \
        name##_at += 1u + inputs + 6u + 7u + 1u;                                              \
        return memcmp(&command, &row[1u + inputs], sizeof command) == 0                       \
            && report.dipole[0] == command.dipole_a_m2[0];                                    \
    }                                                                                         \
    static bool name##_begins(void)                                                           \
    {                                                                                         \
        name##_init(&name##_now);                                                             \
        return name##_self_test() && name##_interface_version() == NAME##_INTERFACE_VERSION;  \
    }

COMPUTER(bus, BUS)
COMPUTER(nav, NAV)

int main(void)
{
    unsigned steps = 0;
    bool same = bus_begins() && nav_begins();
    while (same && steps < 40u) {
        same = bus_flies() && nav_flies();
        steps += same ? 1u : 0u;
    }
    printf("%u steps of both, law works: %d, mode: %s\n", steps,
        nav_is_active(&nav_now, NAV_LAW_TILTED), nav_mode_name(nav_mode(&nav_now, 0)));
    return (same && sizeof(vec3) == 12u && sizeof(mat3) == 36u && ACTIVE == 1) ? 0 : 1;
}
