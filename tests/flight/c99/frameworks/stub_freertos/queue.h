/* A stub of FreeRTOS's header of this name. */
#ifndef QUEUE_STUB_H
#define QUEUE_STUB_H
#include "FreeRTOS.h"
typedef struct QueueDefinition *QueueHandle_t;
QueueHandle_t xQueueCreateStatic(const UBaseType_t uxQueueLength, const UBaseType_t uxItemSize,
    uint8_t *pucQueueStorage, StaticQueue_t *pxStaticQueue);
BaseType_t xQueueSend(QueueHandle_t xQueue, const void *const pvItemToQueue, TickType_t xTicksToWait);
BaseType_t xQueueReceive(QueueHandle_t xQueue, void *const pvBuffer, TickType_t xTicksToWait);
#endif
