/* The app of $name, exported by torquer $version: a control step by the software bus. */
#include "adcs_app.h"

#include <math.h>
#include <string.h>

ADCS_APP_Data_t ADCS_APP_Data;

static const char *const ADCS_APP_MetTexts[ADCS_APP_MET_COUNT] = {
$met_texts};

void ADCS_AppMain(void)
{
    CFE_SB_Buffer_t *SBBufPtr;

    CFE_ES_PerfLogEntry(ADCS_APP_PERF_ID);
    ADCS_APP_Data.RunStatus = CFE_ES_RunStatus_APP_RUN;
    if (ADCS_APP_Init() != CFE_SUCCESS) {
        ADCS_APP_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
    }
    while (CFE_ES_RunLoop(&ADCS_APP_Data.RunStatus) == true) {
        CFE_Status_t Status;
        CFE_ES_PerfLogExit(ADCS_APP_PERF_ID);
        Status = CFE_SB_ReceiveBuffer(&SBBufPtr, ADCS_APP_Data.CommandPipe, CFE_SB_PEND_FOREVER);
        CFE_ES_PerfLogEntry(ADCS_APP_PERF_ID);
        if (Status == CFE_SUCCESS) {
            ADCS_APP_TaskPipe(SBBufPtr);
        } else {
            CFE_EVS_SendEvent(ADCS_APP_PIPE_ERR_EID, CFE_EVS_EventType_ERROR,
                "ADCS_APP: pipe read error, app will exit");
            ADCS_APP_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
        }
    }
    CFE_ES_PerfLogExit(ADCS_APP_PERF_ID);
    CFE_ES_ExitApp(ADCS_APP_Data.RunStatus);
}

static CFE_Status_t ADCS_APP_InitPipe(void)
{
    const CFE_SB_MsgId_Atom_t Mids[] = {
        ADCS_APP_CMD_MID, ADCS_APP_SEND_HK_MID, ADCS_APP_WAKEUP_MID, ADCS_APP_INPUTS_MID};
    CFE_Status_t Status =
        CFE_SB_CreatePipe(&ADCS_APP_Data.CommandPipe, ADCS_APP_PIPE_DEPTH, "ADCS_APP_PIPE");
    for (size_t k = 0; Status == CFE_SUCCESS && k < sizeof Mids / sizeof Mids[0]; k++) {
        Status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(Mids[k]), ADCS_APP_Data.CommandPipe);
    }
    return Status;
}

static CFE_Status_t ADCS_APP_InitTable(void)
{
    CFE_Status_t Status = CFE_TBL_Register(&ADCS_APP_Data.TblHandle, "Parameters",
        sizeof(ADCS_APP_ParametersTbl_t), CFE_TBL_OPT_DEFAULT, ADCS_APP_ValidateTable);
    if (Status == CFE_SUCCESS) {
        if (CFE_TBL_Load(ADCS_APP_Data.TblHandle, CFE_TBL_SRC_FILE, ADCS_APP_TBL_FILE) == CFE_SUCCESS) {
            ADCS_APP_ManageTable();
        } else {
            CFE_EVS_SendEvent(ADCS_APP_TBL_ERR_EID, CFE_EVS_EventType_ERROR,
                "ADCS_APP: no table in %s, parameters are those of the export", ADCS_APP_TBL_FILE);
        }
    }
    return Status;
}

CFE_Status_t ADCS_APP_Init(void)
{
    CFE_Status_t Status = CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
    if (Status != CFE_SUCCESS) {
        CFE_ES_WriteToSysLog("ADCS_APP: error registering events, RC = 0x%08lX\n", (unsigned long)Status);
        return Status;
    }
    if (!adcs_self_test()) {
        CFE_ES_WriteToSysLog(
            "ADCS_APP: this build computes otherwise: compile with $exact\n");
        return CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
    }
    adcs_cycle_begin(&ADCS_APP_Data.Cycle);
    CFE_MSG_Init(CFE_MSG_PTR(ADCS_APP_Data.HkTlm.TelemetryHeader),
        CFE_SB_ValueToMsgId(ADCS_APP_HK_TLM_MID), sizeof ADCS_APP_Data.HkTlm);
    CFE_MSG_Init(CFE_MSG_PTR(ADCS_APP_Data.Actuators.TelemetryHeader),
        CFE_SB_ValueToMsgId(ADCS_APP_ACTUATORS_MID), sizeof ADCS_APP_Data.Actuators);
    Status = ADCS_APP_InitPipe();
    if (Status == CFE_SUCCESS) {
        Status = ADCS_APP_InitTable();
    }
    if (Status != CFE_SUCCESS) {
        CFE_ES_WriteToSysLog("ADCS_APP: error of pipe or table, RC = 0x%08lX\n", (unsigned long)Status);
        return Status;
    }
    CFE_EVS_SendEvent(ADCS_APP_STARTUP_INF_EID, CFE_EVS_EventType_INFORMATION,
        "ADCS_APP: begun, %s", adcs_fingerprint());
    return CFE_SUCCESS;
}

void ADCS_APP_TaskPipe(const CFE_SB_Buffer_t *SBBufPtr)
{
    CFE_SB_MsgId_t MsgId = CFE_SB_INVALID_MSG_ID;
    CFE_MSG_GetMsgId(&SBBufPtr->Msg, &MsgId);
    switch (CFE_SB_MsgIdToValue(MsgId)) {
    case ADCS_APP_INPUTS_MID:
        if (ADCS_APP_VerifyLength(SBBufPtr, sizeof(ADCS_APP_InputsMsg_t))) {
            ADCS_APP_TakeInputs(&((const ADCS_APP_InputsMsg_t *)SBBufPtr)->Payload);
        }
        break;
    case ADCS_APP_WAKEUP_MID:
        ADCS_APP_Wakeup();
        break;
    case ADCS_APP_SEND_HK_MID:
        ADCS_APP_SendHk();
        ADCS_APP_ManageTable();
        break;
    case ADCS_APP_CMD_MID:
        ADCS_APP_ProcessGroundCommand(SBBufPtr);
        break;
    default:
        CFE_EVS_SendEvent(ADCS_APP_MID_ERR_EID, CFE_EVS_EventType_ERROR,
            "ADCS_APP: invalid message id 0x%x", (unsigned int)CFE_SB_MsgIdToValue(MsgId));
        break;
    }
}

static void ADCS_APP_Drive(void)
{
    ADCS_APP_Actuators_Payload_t *Payload = &ADCS_APP_Data.Actuators.Payload;
    memcpy(Payload->DipoleAm2, ADCS_APP_Data.Cycle.driven_dipole_a_m2, sizeof Payload->DipoleAm2);
    memcpy(Payload->TorqueNm, ADCS_APP_Data.Cycle.command.torque_n_m, sizeof Payload->TorqueNm);
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(ADCS_APP_Data.Actuators.TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(ADCS_APP_Data.Actuators.TelemetryHeader), true);
}

/* Whether one more event of a kind may go out. */
static bool ADCS_APP_IsLetOut(uint8 *Sent)
{
    const bool Is = *Sent < ADCS_APP_EVENTS_OF_A_KIND;
    *Sent = (uint8)(*Sent + (Is ? 1 : 0));
    return Is;
}

static void ADCS_APP_Report(double AtS)
{
    const uint32 Risen = ADCS_APP_Data.Cycle.risen;
    for (uint16 k = 0; k < ADCS_APP_MET_COUNT; k++) {
        if ((Risen & ((uint32)1 << k)) != 0 && ADCS_APP_IsLetOut(&ADCS_APP_Data.MetSent[k])) {
            CFE_EVS_SendEvent((uint16)(ADCS_APP_MET_FIRST_EID + k), CFE_EVS_EventType_ERROR,
                "ADCS_APP: %s; at %.3f s", ADCS_APP_MetTexts[k], AtS);
        }
    }
    if ((Risen & ADCS_MET_LAW_FAILED) != 0) {
        int64_t Line = 0;
        const int64_t Blocks = adcs_failures(&ADCS_APP_Data.Cycle.state, &Line);
        CFE_EVS_SendEvent(ADCS_APP_LAW_ERR_EID, CFE_EVS_EventType_ERROR,
            "ADCS_APP: bits 0x%lx of ADCS_FAILED_..., line %ld", (unsigned long)Blocks, (long)Line);
    }
}

void ADCS_APP_TakeInputs(const adcs_inputs *Given)
{
    if (ADCS_APP_Data.IsDue) {
        ADCS_APP_Data.IsDue = false;
        adcs_cycle_step(&ADCS_APP_Data.Cycle, Given);
        ADCS_APP_Drive();
        ADCS_APP_Report(Given->t_s);
    }
}

/* A step that was due has had no inputs: it commands nothing. */
static void ADCS_APP_Miss(void)
{
    adcs_cycle_step(&ADCS_APP_Data.Cycle, NULL);
    ADCS_APP_Drive();
    if (ADCS_APP_IsLetOut(&ADCS_APP_Data.MissedSent)) {
        CFE_EVS_SendEvent(ADCS_APP_MISSING_ERR_EID, CFE_EVS_EventType_ERROR,
            "ADCS_APP: no inputs, %lu times", (unsigned long)ADCS_APP_Data.Cycle.missed);
    }
}

/* A tick: the coils are left off before sensors measure, whose readings the step then waits for. */
void ADCS_APP_Wakeup(void)
{
    if (ADCS_APP_Data.IsDue) {
        ADCS_APP_Miss();
    }
    if (ADCS_APP_Data.IsAwake) {
        adcs_cycle_tick(&ADCS_APP_Data.Cycle);
    }
    ADCS_APP_Data.IsAwake = true;
    if (adcs_cycle_opens_window(&ADCS_APP_Data.Cycle)) {
        ADCS_APP_Drive();
    }
    ADCS_APP_Data.IsDue = adcs_cycle_is_due(&ADCS_APP_Data.Cycle);
}

void ADCS_APP_SendHk(void)
{
    const adcs_state *StatePtr = &ADCS_APP_Data.Cycle.state;
    ADCS_APP_HkTlm_Payload_t *Hk = &ADCS_APP_Data.HkTlm.Payload;
    Hk->CommandCounter = ADCS_APP_Data.CmdCounter;
    Hk->CommandErrorCounter = ADCS_APP_Data.ErrCounter;
    Hk->Steps = ADCS_APP_Data.Cycle.steps;
    Hk->Missed = ADCS_APP_Data.Cycle.missed;
    Hk->Met = ADCS_APP_Data.Cycle.met;
    Hk->Failures = adcs_failures(StatePtr, &Hk->FailureLine);
    Hk->Command = ADCS_APP_Data.Cycle.command;
    Hk->Estimate = adcs_estimated(StatePtr);
$mode_reports    CFE_SB_TimeStampMsg(CFE_MSG_PTR(ADCS_APP_Data.HkTlm.TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(ADCS_APP_Data.HkTlm.TelemetryHeader), true);
}

CFE_Status_t ADCS_APP_ValidateTable(void *TblData)
{
    const ADCS_APP_ParametersTbl_t *Table = TblData;
    bool AreRight = Table->Numbers == ADCS_APP_TBL_NUMBERS;
$table_checks    return AreRight ? CFE_SUCCESS : ADCS_APP_TBL_INVALID_ERR;
}

static void ADCS_APP_SetParameter(int32 ParameterPlace, double Value)
{
    adcs_outcome Outcome;
    if (adcs_parameter(&ADCS_APP_Data.Cycle.state, ParameterPlace) == Value) {
        return;
    }
    Outcome = adcs_set_parameter(&ADCS_APP_Data.Cycle.state, ParameterPlace, Value);
    CFE_EVS_SendEvent((Outcome == ADCS_DONE) ? ADCS_APP_TBL_INF_EID : ADCS_APP_TBL_ERR_EID,
        (Outcome == ADCS_DONE) ? CFE_EVS_EventType_INFORMATION : CFE_EVS_EventType_ERROR,
        "ADCS_APP: parameter place %ld is %.9g by the table: %s", (long)ParameterPlace,
        adcs_parameter(&ADCS_APP_Data.Cycle.state, ParameterPlace), adcs_outcome_text(Outcome));
}

static void ADCS_APP_ApplyTable(const ADCS_APP_ParametersTbl_t *Table)
{
$table_applies}

void ADCS_APP_ManageTable(void)
{
    void *Table = NULL;
    CFE_TBL_Manage(ADCS_APP_Data.TblHandle);
    if (CFE_TBL_GetAddress(&Table, ADCS_APP_Data.TblHandle) == CFE_TBL_INFO_UPDATED) {
        ADCS_APP_ApplyTable(Table);
    }
    CFE_TBL_ReleaseAddress(ADCS_APP_Data.TblHandle);
}
