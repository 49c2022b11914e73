/* Flies the app for cFS around recorded control steps, by the software bus of a stub:
   fly recorded.bin */
#include "adcs_app.h"
#include "record.h"

#include <stdarg.h>
#include <stdlib.h>

extern ADCS_APP_ParametersTbl_t ADCS_APP_ParametersTbl;

typedef union {
    CFE_SB_Buffer_t Buffer;
    ADCS_APP_InputsMsg_t Inputs;
    ADCS_APP_CommandModeCmd_t Mode;
    ADCS_APP_SetParameterCmd_t Set;
    ADCS_APP_RebaseCmd_t Rebase;
    ADCS_APP_NoArgsCmd_t NoArgs;
} any_message;

static FILE *file;
static uint64_t steps;
static uint64_t same;
static recorded_step step;
static any_message message;
static ADCS_APP_ActuatorsMsg_t driven;
static ADCS_APP_HkTlm_t housekeeping;
static unsigned sent[256];
static bool is_table_new;
static bool is_read;
static int stage;
static bool is_good = true;

static CFE_SB_Buffer_t *filled(uint32 id, uint16 code, size_t size)
{
    message.Buffer.Msg.Id.Value = id;
    message.Buffer.Msg.Code = code;
    message.Buffer.Msg.Size = (uint16)size;
    return &message.Buffer;
}

static void check(bool good, const char *what)
{
    if (!good) {
        printf("otherwise: %s\n", what);
        is_good = false;
    }
}

/* Inputs whose time is no number, and others in between: 40 of them, each with its step. */
static CFE_SB_Buffer_t *next_of_bad_times(void)
{
    static unsigned trials;
    if (trials == 40) {
        return NULL;
    }
    if (!ADCS_APP_Data.IsDue) {
        return filled(ADCS_APP_WAKEUP_MID, 0, sizeof message.NoArgs);
    }
    trials++;
    message.Inputs.Payload = step.inputs;
    message.Inputs.Payload.t_s = (trials % 2 == 0) ? (double)NAN : step.inputs.t_s;
    return filled(ADCS_APP_INPUTS_MID, 0, sizeof message.Inputs);
}

/* Messages after the last step: commands, and what was said of the one before. */
static CFE_SB_Buffer_t *next_of_ground(void)
{
    const double none[3] = {0.0, 0.0, 0.0};
    CFE_SB_Buffer_t *next = (stage == 9) ? next_of_bad_times() : NULL;
    if (next != NULL) {
        return next;
    }
    stage++;
    switch (stage) {
    case 1:
        return filled(ADCS_APP_CMD_MID, ADCS_APP_NOOP_CC, sizeof message.NoArgs);
    case 2:
        check(sent[ADCS_APP_NOOP_INF_EID] == 1 && ADCS_APP_Data.CmdCounter == 1, "no-op");
        message.Rebase.ShiftS = (double)NAN;
        return filled(ADCS_APP_CMD_MID, ADCS_APP_REBASE_CC, sizeof message.Rebase);
    case 3:
        check(sent[ADCS_APP_REFUSED_ERR_EID] == 1 && ADCS_APP_Data.ErrCounter == 1, "refused");
        return filled(ADCS_APP_CMD_MID, ADCS_APP_REBASE_CC, sizeof message.Rebase - 1);
    case 4:
        check(sent[ADCS_APP_LEN_ERR_EID] == 1 && ADCS_APP_Data.ErrCounter == 2, "length");
        return filled(ADCS_APP_CMD_MID, 99, sizeof message.NoArgs);
    case 5:
        check(sent[ADCS_APP_CC_ERR_EID] == 1 && ADCS_APP_Data.ErrCounter == 3, "code");
        return filled(ADCS_APP_CMD_MID, ADCS_APP_RESTART_ESTIMATORS_CC, sizeof message.NoArgs);
    case 6:
        check(sent[ADCS_APP_DONE_INF_EID] == 1 && ADCS_APP_Data.CmdCounter == 2, "done");
        message.Mode.Region = 1000;
        message.Mode.Mode = 0;
        return filled(ADCS_APP_CMD_MID, ADCS_APP_COMMAND_MODE_CC, sizeof message.Mode);
    case 7:
        check(sent[ADCS_APP_REFUSED_ERR_EID] == 2, "no such region");
        return filled(0x1fff, 0, sizeof message.NoArgs);
    case 8:
        check(sent[ADCS_APP_MID_ERR_EID] == 1, "message id");
        return filled(ADCS_APP_SEND_HK_MID, 0, sizeof message.NoArgs);
    case 9:
        check(housekeeping.Payload.Steps == (uint32)steps && housekeeping.Payload.CommandCounter == 2 &&
                  housekeeping.Payload.CommandErrorCounter == 4, "housekeeping");
        ADCS_APP_ParametersTbl.Numbers++;
        check(ADCS_APP_ValidateTable(&ADCS_APP_ParametersTbl) != CFE_SUCCESS, "another table");
        return filled(ADCS_APP_CMD_MID, ADCS_APP_NOOP_CC, sizeof message.NoArgs);
    case 10:
        check(sent[ADCS_APP_MET_FIRST_EID] == ADCS_APP_EVENTS_OF_A_KIND, "throttle");
        return filled(ADCS_APP_CMD_MID, ADCS_APP_RESET_COUNTERS_CC, sizeof message.NoArgs);
    default:
        check(ADCS_APP_Data.CmdCounter == 0 && ADCS_APP_Data.ErrCounter == 0, "counters");
        if (sent[ADCS_APP_MISSING_ERR_EID] == 0) {
            return filled(ADCS_APP_WAKEUP_MID, 0, sizeof message.NoArgs);
        }
        check(are_same(driven.Payload.DipoleAm2, none, 3), "no inputs, no command");
        return NULL;
    }
}

/* Ticks until a step is due, then its inputs. */
static CFE_SB_Buffer_t *next_of_flight(void)
{
    if (is_read) {
        const adcs_estimate estimate = adcs_estimated(&ADCS_APP_Data.Cycle.state);
        is_read = false;
        if (!are_same(ADCS_APP_Data.Cycle.command.dipole_a_m2, step.command, 3) ||
            !are_same(driven.Payload.TorqueNm, step.command + 3, 3) ||
            !are_same(estimate.q_body_to_inertial, step.estimate, 4) ||
            !are_same(estimate.omega_body_rad_s, step.estimate + 4, 3)) {
            return NULL;
        }
        same++;
    }
    if (same == steps) {
        return next_of_ground();
    }
    if (!ADCS_APP_Data.IsDue) {
        return filled(ADCS_APP_WAKEUP_MID, 0, sizeof message.NoArgs);
    }
    if (!is_step_read(file, &step) || step.anew > 0.0) {
        return NULL;
    }
    is_read = true;
    message.Inputs.Payload = step.inputs;
    return filled(ADCS_APP_INPUTS_MID, 0, sizeof message.Inputs);
}

CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **BufPtr, CFE_SB_PipeId_t PipeId, int32 TimeOut)
{
    (void)PipeId;
    (void)TimeOut;
    *BufPtr = next_of_flight();
    return (*BufPtr != NULL) ? CFE_SUCCESS : -1;
}

CFE_Status_t CFE_SB_TransmitMsg(CFE_MSG_Message_t *MsgPtr, bool IncrementSequenceCount)
{
    (void)IncrementSequenceCount;
    if (MsgPtr->Id.Value == ADCS_APP_ACTUATORS_MID) {
        memcpy(&driven, MsgPtr, sizeof driven);
    } else {
        memcpy(&housekeeping, MsgPtr, sizeof housekeeping);
    }
    return CFE_SUCCESS;
}

CFE_Status_t CFE_SB_CreatePipe(CFE_SB_PipeId_t *PipeIdPtr, uint16 Depth, const char *PipeName)
{
    (void)PipeName;
    *PipeIdPtr = Depth;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_SB_Subscribe(CFE_SB_MsgId_t MsgId, CFE_SB_PipeId_t PipeId)
{
    return (MsgId.Value != 0 && PipeId != 0) ? CFE_SUCCESS : -1;
}

void CFE_SB_TimeStampMsg(CFE_MSG_Message_t *MsgPtr)
{
    (void)MsgPtr;
}

CFE_SB_MsgId_t CFE_SB_ValueToMsgId(CFE_SB_MsgId_Atom_t MsgIdValue)
{
    const CFE_SB_MsgId_t id = {MsgIdValue};
    return id;
}

CFE_SB_MsgId_Atom_t CFE_SB_MsgIdToValue(CFE_SB_MsgId_t MsgId)
{
    return MsgId.Value;
}

CFE_Status_t CFE_MSG_Init(CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t MsgId, CFE_MSG_Size_t Size)
{
    MsgPtr->Id = MsgId;
    MsgPtr->Size = (uint16)Size;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_MSG_GetMsgId(const CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t *MsgId)
{
    *MsgId = MsgPtr->Id;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_MSG_GetFcnCode(const CFE_MSG_Message_t *MsgPtr, CFE_MSG_FcnCode_t *FcnCode)
{
    *FcnCode = MsgPtr->Code;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *MsgPtr, CFE_MSG_Size_t *Size)
{
    *Size = MsgPtr->Size;
    return CFE_SUCCESS;
}

bool CFE_ES_RunLoop(uint32 *RunStatus)
{
    return *RunStatus == CFE_ES_RunStatus_APP_RUN;
}

void CFE_ES_ExitApp(uint32 ExitStatus)
{
    (void)ExitStatus;
}

CFE_Status_t CFE_ES_WriteToSysLog(const char *SpecStringPtr, ...)
{
    printf("%s", SpecStringPtr);
    return CFE_SUCCESS;
}

void CFE_ES_PerfLogAdd(uint32 Marker, uint32 EntryExit)
{
    (void)Marker;
    (void)EntryExit;
}

CFE_Status_t CFE_EVS_Register(const void *Filters, uint16 NumEventFilters, uint16 FilterScheme)
{
    (void)Filters;
    (void)NumEventFilters;
    (void)FilterScheme;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_EVS_SendEvent(uint16 EventID, uint16 EventType, const char *Spec, ...)
{
    (void)EventType;
    (void)Spec;
    sent[EventID]++;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *TblHandlePtr, const char *Name, size_t Size,
    uint16 TblOptionFlags, CFE_TBL_CallbackFuncPtr_t TblValidationFuncPtr)
{
    (void)Name;
    (void)TblOptionFlags;
    (void)TblValidationFuncPtr;
    *TblHandlePtr = 1;
    return (Size == sizeof ADCS_APP_ParametersTbl) ? CFE_SUCCESS : -1;
}

CFE_Status_t CFE_TBL_Load(
    CFE_TBL_Handle_t TblHandle, CFE_TBL_SrcEnum_t SrcType, const void *SrcDataPtr)
{
    (void)TblHandle;
    (void)SrcType;
    (void)SrcDataPtr;
    is_table_new = true;
    return ADCS_APP_ValidateTable(&ADCS_APP_ParametersTbl);
}

CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t TblHandle)
{
    (void)TblHandle;
    return CFE_SUCCESS;
}

CFE_Status_t CFE_TBL_GetAddress(void **TblPtr, CFE_TBL_Handle_t TblHandle)
{
    const bool is_new = is_table_new;
    (void)TblHandle;
    *TblPtr = &ADCS_APP_ParametersTbl;
    is_table_new = false;
    return is_new ? CFE_TBL_INFO_UPDATED : CFE_SUCCESS;
}

CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t TblHandle)
{
    (void)TblHandle;
    return CFE_SUCCESS;
}

int main(int count, char **arguments)
{
    int status;
    file = opened_record((count > 1) ? arguments[1] : "", &steps);
    if (file == NULL) {
        return 2;
    }
    ADCS_AppMain();
    (void)fclose(file);
    check(sent[ADCS_APP_STARTUP_INF_EID] == 1, "begun");
    check(sent[ADCS_APP_TBL_INF_EID] + sent[ADCS_APP_TBL_ERR_EID] == 0, "table of the export");
    check(sent[ADCS_APP_PIPE_ERR_EID] == 1, "pipe");
    status = said(same, steps);
    return is_good ? status : 1;
}
