/* Flies the task for FreeRTOS around recorded control steps, in the kernel of a stub:
   fly recorded.bin */
#include "adcs_task.h"
#include "record.h"

#include <setjmp.h>

static FILE *file;
static uint64_t steps;
static uint64_t same;
static recorded_step step;
static jmp_buf over;
static TaskFunction_t task;
static adcs_request queued[ADCS_TASK_REQUESTS];
static size_t waiting;
static unsigned refused;
static unsigned done;
static double driven[3];
static double torque[3];
static TickType_t now;
static bool is_measuring;
static unsigned windows;

static bool is_zero(const double *v)
{
    return v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0;
}

bool adcs_board_read(adcs_inputs *inputs)
{
    if (same == steps) {
        return false;
    }
    if (!is_step_read(file, &step) || step.anew > 0.0) {
        longjmp(over, 1);
    }
    *inputs = step.inputs;
    return true;
}

void adcs_board_drive(const double dipole_a_m2[3], const double torque_n_m[3])
{
    memcpy(driven, dipole_a_m2, sizeof driven);
    memcpy(torque, torque_n_m, sizeof torque);
}

void adcs_board_stepped(const adcs_cycle *cycle)
{
    const adcs_estimate estimate = adcs_estimated(&cycle->state);
    if (cycle->missed > 0) {
        longjmp(over, 1);
    }
    is_measuring = cycle->tick < ADCS_MEASURE_TICKS;
    windows += (is_measuring && cycle->tick == 0) ? 1u : 0u;
    if (!are_same(cycle->command.dipole_a_m2, step.command, 3) ||
        !are_same(torque, step.command + 3, 3) || (is_measuring && !is_zero(driven)) ||
        (cycle->tick == ADCS_MEASURE_TICKS && !are_same(driven, step.command, 3)) ||
        !are_same(estimate.q_body_to_inertial, step.estimate, 4) ||
        !are_same(estimate.omega_body_rad_s, step.estimate + 4, 3)) {
        longjmp(over, 1);
    }
    same++;
}

void adcs_board_met(uint32_t met)
{
    (void)met;
}

void adcs_board_answered(const adcs_request *request, adcs_outcome outcome)
{
    (void)request;
    refused += (outcome == ADCS_DONE) ? 0u : 1u;
    done += (outcome == ADCS_DONE) ? 1u : 0u;
}

void adcs_board_late(uint32_t count)
{
    (void)count;
}

TaskHandle_t xTaskCreateStatic(TaskFunction_t pxTaskCode, const char *const pcName,
    const configSTACK_DEPTH_TYPE uxStackDepth, void *const pvParameters, UBaseType_t uxPriority,
    StackType_t *const puxStackBuffer, StaticTask_t *const pxTaskBuffer)
{
    (void)pcName;
    (void)uxStackDepth;
    (void)pvParameters;
    (void)uxPriority;
    (void)puxStackBuffer;
    task = pxTaskCode;
    return (TaskHandle_t)(void *)pxTaskBuffer;
}

BaseType_t xTaskDelayUntil(TickType_t *const pxPreviousWakeTime, const TickType_t xTimeIncrement)
{
    now += xTimeIncrement;
    *pxPreviousWakeTime = now;
    return pdTRUE;
}

TickType_t xTaskGetTickCount(void)
{
    return now;
}

QueueHandle_t xQueueCreateStatic(const UBaseType_t uxQueueLength, const UBaseType_t uxItemSize,
    uint8_t *pucQueueStorage, StaticQueue_t *pxStaticQueue)
{
    (void)pucQueueStorage;
    return (uxQueueLength == ADCS_TASK_REQUESTS && uxItemSize == sizeof(adcs_request))
        ? (QueueHandle_t)(void *)pxStaticQueue
        : NULL;
}

BaseType_t xQueueSend(QueueHandle_t xQueue, const void *const pvItemToQueue, TickType_t xTicksToWait)
{
    (void)xQueue;
    (void)xTicksToWait;
    if (waiting == ADCS_TASK_REQUESTS) {
        return errQUEUE_FULL;
    }
    memcpy(&queued[waiting], pvItemToQueue, sizeof queued[0]);
    waiting++;
    return pdPASS;
}

BaseType_t xQueueReceive(QueueHandle_t xQueue, void *const pvBuffer, TickType_t xTicksToWait)
{
    (void)xQueue;
    (void)xTicksToWait;
    if (waiting == 0) {
        return pdFALSE;
    }
    waiting--;
    memcpy(pvBuffer, &queued[waiting], sizeof queued[0]);
    return pdPASS;
}

static void ask(void)
{
    adcs_request request = {ADCS_REQUEST_REBASE, 1, 0, 0, (double)NAN, false};
    (void)adcs_task_request(&request, 0);
    request.kind = ADCS_REQUEST_MODE;
    request.which = 1000;
    (void)adcs_task_request(&request, 0);
    request.kind = ADCS_REQUEST_CLEAR;
    (void)adcs_task_request(&request, 0);
}

int main(int count, char **arguments)
{
    int status;
    file = opened_record((count > 1) ? arguments[1] : "", &steps);
    if (file == NULL) {
        return 2;
    }
    (void)adcs_task_start(1);
    ask();
    if (setjmp(over) == 0) {
        task(NULL);
    }
    (void)fclose(file);
    status = said(same, steps);
    printf("%lu ticks, %u windows\n", (unsigned long)now, windows);
    return (refused == 2 && done == 1 && is_zero(driven)) ? status : 1;
}
