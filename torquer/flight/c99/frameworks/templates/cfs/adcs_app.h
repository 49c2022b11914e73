/* The app of $name, exported by torquer $version. */
#ifndef ADCS_APP_H
#define ADCS_APP_H

#include "cfe.h"

#include "adcs_cycle.h"

#include "adcs_app_events.h"
#include "adcs_app_msg.h"
#include "adcs_app_msgids.h"
#include "adcs_app_perfids.h"
#include "adcs_app_tbl.h"

#define ADCS_APP_PIPE_DEPTH 16
#ifndef ADCS_APP_TBL_FILE
#define ADCS_APP_TBL_FILE "/cf/adcs_app_tbl.tbl"
#endif
#define ADCS_APP_TBL_INVALID_ERR (-1)

typedef struct {
    adcs_cycle Cycle;
    bool IsAwake; /* since the first tick */
    bool IsDue;   /* a step of the present tick, for which inputs are awaited */
    uint8 CmdCounter;
    uint8 ErrCounter;
    uint8 MetSent[ADCS_APP_MET_COUNT];
    uint8 MissedSent;
    uint32 RunStatus;
    CFE_SB_PipeId_t CommandPipe;
    CFE_TBL_Handle_t TblHandle;
    ADCS_APP_HkTlm_t HkTlm;
    ADCS_APP_ActuatorsMsg_t Actuators;
} ADCS_APP_Data_t;

extern ADCS_APP_Data_t ADCS_APP_Data;

void ADCS_AppMain(void);
CFE_Status_t ADCS_APP_Init(void);
void ADCS_APP_TaskPipe(const CFE_SB_Buffer_t *SBBufPtr);
void ADCS_APP_Wakeup(void);
void ADCS_APP_TakeInputs(const adcs_inputs *Given);
void ADCS_APP_SendHk(void);
CFE_Status_t ADCS_APP_ValidateTable(void *TblData);
void ADCS_APP_ManageTable(void);

/* Commands from the ground, in adcs_app_cmds.c. */
bool ADCS_APP_VerifyLength(const CFE_SB_Buffer_t *SBBufPtr, size_t Expected);
void ADCS_APP_ProcessGroundCommand(const CFE_SB_Buffer_t *SBBufPtr);

#endif
