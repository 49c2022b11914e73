/* A stub: the little of FreeRTOS's headers that the task names, with its signatures. */
#ifndef FREERTOS_STUB_H
#define FREERTOS_STUB_H

#include <stdint.h>
#include <stdlib.h>

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
typedef uint32_t StackType_t;
typedef uint32_t configSTACK_DEPTH_TYPE;
#define pdFALSE ((BaseType_t)0)
#define pdTRUE ((BaseType_t)1)
#define pdPASS pdTRUE
#define errQUEUE_FULL ((BaseType_t)0)
#define configASSERT(x) ((x) ? (void)0 : abort())
#define configSUPPORT_STATIC_ALLOCATION 1
#define INCLUDE_xTaskDelayUntil 1
#ifndef configTICK_RATE_HZ
#define configTICK_RATE_HZ ((TickType_t)1000)
#endif
typedef struct {
    void *pxDummy;
} StaticTask_t;
typedef struct {
    void *pxDummy;
} StaticQueue_t;

#endif
