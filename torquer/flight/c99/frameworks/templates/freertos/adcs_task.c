/* The on-board computer of $name as a task of FreeRTOS, exported by torquer $version. */
#include "adcs_task.h"

#include <string.h>

#if (configSUPPORT_STATIC_ALLOCATION != 1)
#error "configSUPPORT_STATIC_ALLOCATION must be 1: the task allocates nothing"
#endif
#if (INCLUDE_xTaskDelayUntil != 1)
#error "INCLUDE_xTaskDelayUntil must be 1: control steps are periodic"
#endif

#define NS_PER_S INT64_C(1000000000)
#define RTOS_TICKS_NS (ADCS_TICK_NS * (int64_t)configTICK_RATE_HZ)

/* configTICK_RATE_HZ must make a tick of the control cycle a whole number of ticks, or it drifts. */
typedef char adcs_tick_is_whole[(RTOS_TICKS_NS >= NS_PER_S && RTOS_TICKS_NS % NS_PER_S == 0) ? 1 : -1];

static adcs_cycle cycle;
static uint8_t sent[ADCS_TASK_MET_COUNT];
static uint32_t late;

static StaticTask_t task_memory;
static StackType_t task_stack[ADCS_TASK_STACK_WORDS];
static StaticQueue_t queue_memory;
static uint8_t queue_storage[ADCS_TASK_REQUESTS * sizeof(adcs_request)];
static QueueHandle_t requests;

static adcs_outcome carry(const adcs_request *request)
{
    switch (request->kind) {
    case ADCS_REQUEST_MODE:
        return adcs_command_mode(&cycle.state, request->which, request->mode);
    case ADCS_REQUEST_HOLD:
        return adcs_hold(&cycle.state, request->which, request->on);
    case ADCS_REQUEST_FLAG:
        return adcs_set_flag(&cycle.state, request->which, request->on);
    case ADCS_REQUEST_PARAMETER:
        return adcs_set_parameter(&cycle.state, request->which, request->value);
    case ADCS_REQUEST_REBASE:
        return adcs_rebase(&cycle.state, request->value);
    case ADCS_REQUEST_RESTART:
        return adcs_restart_estimators(&cycle.state);
    case ADCS_REQUEST_CLEAR:
        memset(sent, 0, sizeof sent);
        return ADCS_DONE;
    default:
        return ADCS_NO_SUCH;
    }
}

static void take_requests(void)
{
    adcs_request request;
    while (xQueueReceive(requests, &request, 0) == pdPASS) {
        adcs_board_answered(&request, carry(&request));
    }
}

static void report(void)
{
    uint32_t out = 0;
    for (uint32_t k = 0; k < ADCS_TASK_MET_COUNT; k++) {
        const uint32_t bit = (uint32_t)1 << k;
        if ((cycle.risen & bit) != 0u && sent[k] < ADCS_TASK_EVENTS_OF_A_KIND) {
            sent[k]++;
            out |= bit;
        }
    }
    if (out != 0u) {
        adcs_board_met(out);
    }
}

static void step(void)
{
    adcs_inputs inputs;
    memset(&inputs, 0, sizeof inputs);
    adcs_cycle_step(&cycle, adcs_board_read(&inputs) ? &inputs : NULL);
    adcs_board_drive(cycle.driven_dipole_a_m2, cycle.command.torque_n_m);
    report();
    adcs_board_stepped(&cycle);
}

static void run(void *unused)
{
    const TickType_t period = (TickType_t)(RTOS_TICKS_NS / NS_PER_S);
    TickType_t woken = xTaskGetTickCount();
    (void)unused;
    for (;;) {
        take_requests();
        if (adcs_cycle_opens_window(&cycle)) {
            adcs_board_drive(cycle.driven_dipole_a_m2, cycle.command.torque_n_m);
        }
        if (adcs_cycle_is_due(&cycle)) {
            step();
        }
        adcs_cycle_tick(&cycle);
        if (xTaskDelayUntil(&woken, period) == pdFALSE) {
            late++;
            adcs_board_late(late);
        }
    }
}

TaskHandle_t adcs_task_start(UBaseType_t priority)
{
    TaskHandle_t task;
    configASSERT(adcs_self_test());
    adcs_cycle_begin(&cycle);
    memset(sent, 0, sizeof sent);
    late = 0;
    requests = xQueueCreateStatic(
        ADCS_TASK_REQUESTS, sizeof(adcs_request), queue_storage, &queue_memory);
    configASSERT(requests != NULL);
    task = xTaskCreateStatic(
        run, "adcs", ADCS_TASK_STACK_WORDS, NULL, priority, task_stack, &task_memory);
    configASSERT(task != NULL);
    return task;
}

BaseType_t adcs_task_request(const adcs_request *request, TickType_t wait)
{
    return xQueueSend(requests, request, wait);
}
