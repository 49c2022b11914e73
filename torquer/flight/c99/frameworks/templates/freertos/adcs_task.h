/* The on-board computer of $name as a task of FreeRTOS, exported by torquer $version.

   The task wakes at every tick of the control cycle, leaves the coils off while sensors measure,
   takes the control steps that are due, and hands their commands to the board. */
#ifndef ADCS_TASK_H
#define ADCS_TASK_H

#include "FreeRTOS.h"

#include "queue.h"
#include "task.h"

#include "adcs_cycle.h"

/* Stack of the task: that of a control step, which make pil measures, and of your hooks. */
#ifndef ADCS_TASK_STACK_WORDS
#define ADCS_TASK_STACK_WORDS 4096
#endif
/* Requests that may wait for the next tick. */
#ifndef ADCS_TASK_REQUESTS
#define ADCS_TASK_REQUESTS 8
#endif
/* How many events of a kind go out until they are cleared. */
#ifndef ADCS_TASK_EVENTS_OF_A_KIND
#define ADCS_TASK_EVENTS_OF_A_KIND 16u
#endif

/* Bits of what a step may meet. */
#define ADCS_TASK_MET_COUNT $met_count

/* What another task asks for; in brackets what it is given beside `tag`, which is yours. */
typedef enum {
    ADCS_REQUEST_MODE = 0,      /* a region enters a state [which, mode] */
    ADCS_REQUEST_HOLD = 1,      /* transitions of a region are kept [which, on] */
    ADCS_REQUEST_FLAG = 2,      /* a flag is raised [which, on] */
    ADCS_REQUEST_PARAMETER = 3, /* a number of a parameter is set [which, value] */
    ADCS_REQUEST_REBASE = 4,    /* the clock has been set forward [value, s] */
    ADCS_REQUEST_RESTART = 5,   /* the estimators begin again */
    ADCS_REQUEST_CLEAR = 6      /* events that were throttled go out again */
} adcs_request_kind;

typedef struct {
    adcs_request_kind kind;
    uint32_t tag;
    int32_t which;
    int32_t mode;
    double value;
    bool on;
} adcs_request;

/* Hooks: the board has them; the task calls them. */

/* Fill in the latest readings, their times and the present time; false: there are none. */
bool adcs_board_read(adcs_inputs *inputs);

/* Have coils and wheels make this from now on, body axes [A m^2], [N m]. */
void adcs_board_drive(const double dipole_a_m2[3], const double torque_n_m[3]);

/* A control step has been taken, or had no inputs: for telemetry. */
void adcs_board_stepped(const adcs_cycle *cycle);

/* The last step has met what the one before had not: bits ADCS_MET_..., throttled. */
void adcs_board_met(uint32_t met);

/* What became of a request. */
void adcs_board_answered(const adcs_request *request, adcs_outcome outcome);

/* A tick came too late, for so many times now. */
void adcs_board_late(uint32_t count);

/* Create the task; it runs when the scheduler does. */
TaskHandle_t adcs_task_start(UBaseType_t priority);

/* Send a request from another task; pdPASS, or errQUEUE_FULL after `wait` ticks. */
BaseType_t adcs_task_request(const adcs_request *request, TickType_t wait);

#endif
