/* Commands from the ground to the app of $name, exported by torquer $version. */
#include "adcs_app.h"

#include <string.h>

bool ADCS_APP_VerifyLength(const CFE_SB_Buffer_t *SBBufPtr, size_t Expected)
{
    CFE_MSG_Size_t Actual = 0;
    CFE_SB_MsgId_t MsgId = CFE_SB_INVALID_MSG_ID;
    CFE_MSG_FcnCode_t FcnCode = 0;
    CFE_MSG_GetSize(&SBBufPtr->Msg, &Actual);
    if (Actual == Expected) {
        return true;
    }
    CFE_MSG_GetMsgId(&SBBufPtr->Msg, &MsgId);
    CFE_MSG_GetFcnCode(&SBBufPtr->Msg, &FcnCode);
    ADCS_APP_Data.ErrCounter++;
    CFE_EVS_SendEvent(ADCS_APP_LEN_ERR_EID, CFE_EVS_EventType_ERROR,
        "ADCS_APP: invalid length: id 0x%X, code %u, %u bytes, expected %u",
        (unsigned int)CFE_SB_MsgIdToValue(MsgId), (unsigned int)FcnCode, (unsigned int)Actual,
        (unsigned int)Expected);
    return false;
}

/* Confirm a command that took effect; say of another why it did not. */
static void ADCS_APP_Answer(CFE_MSG_FcnCode_t Code, adcs_outcome Outcome)
{
    if (Outcome == ADCS_DONE) {
        ADCS_APP_Data.CmdCounter++;
        CFE_EVS_SendEvent(ADCS_APP_DONE_INF_EID, CFE_EVS_EventType_INFORMATION,
            "ADCS_APP: command %u: %s", (unsigned int)Code, adcs_outcome_text(Outcome));
    } else {
        ADCS_APP_Data.ErrCounter++;
        CFE_EVS_SendEvent(ADCS_APP_REFUSED_ERR_EID, CFE_EVS_EventType_ERROR,
            "ADCS_APP: command %u refused: %s", (unsigned int)Code, adcs_outcome_text(Outcome));
    }
}

static void ADCS_APP_ResetCounters(void)
{
    ADCS_APP_Data.CmdCounter = 0;
    ADCS_APP_Data.ErrCounter = 0;
    ADCS_APP_Data.MissedSent = 0;
    memset(ADCS_APP_Data.MetSent, 0, sizeof ADCS_APP_Data.MetSent);
    CFE_EVS_SendEvent(
        ADCS_APP_RESET_INF_EID, CFE_EVS_EventType_INFORMATION, "ADCS_APP: counters reset");
}

/* How long a command of a code is; 0 for a code that there is not. */
static size_t ADCS_APP_LengthOf(CFE_MSG_FcnCode_t Code)
{
    switch (Code) {
    case ADCS_APP_NOOP_CC:
    case ADCS_APP_RESET_COUNTERS_CC:
    case ADCS_APP_RESTART_ESTIMATORS_CC:
        return sizeof(ADCS_APP_NoArgsCmd_t);
    case ADCS_APP_COMMAND_MODE_CC:
        return sizeof(ADCS_APP_CommandModeCmd_t);
    case ADCS_APP_HOLD_CC:
    case ADCS_APP_SET_FLAG_CC:
        return sizeof(ADCS_APP_SwitchCmd_t);
    case ADCS_APP_SET_PARAMETER_CC:
        return sizeof(ADCS_APP_SetParameterCmd_t);
    case ADCS_APP_REBASE_CC:
        return sizeof(ADCS_APP_RebaseCmd_t);
    default:
        return 0;
    }
}

/* A command of the right length to the library. */
static adcs_outcome ADCS_APP_Carry(const CFE_SB_Buffer_t *SBBufPtr, CFE_MSG_FcnCode_t Code)
{
    adcs_state *StatePtr = &ADCS_APP_Data.Cycle.state;
    const ADCS_APP_CommandModeCmd_t *Mode = (const ADCS_APP_CommandModeCmd_t *)SBBufPtr;
    const ADCS_APP_SwitchCmd_t *Switch = (const ADCS_APP_SwitchCmd_t *)SBBufPtr;
    const ADCS_APP_SetParameterCmd_t *Set = (const ADCS_APP_SetParameterCmd_t *)SBBufPtr;
    const ADCS_APP_RebaseCmd_t *Rebase = (const ADCS_APP_RebaseCmd_t *)SBBufPtr;
    switch (Code) {
    case ADCS_APP_COMMAND_MODE_CC:
        return adcs_command_mode(StatePtr, Mode->Region, Mode->Mode);
    case ADCS_APP_HOLD_CC:
        return adcs_hold(StatePtr, Switch->Which, Switch->On != 0);
    case ADCS_APP_SET_FLAG_CC:
        return adcs_set_flag(StatePtr, Switch->Which, Switch->On != 0);
    case ADCS_APP_SET_PARAMETER_CC:
        return adcs_set_parameter(StatePtr, Set->Place, Set->Value);
    case ADCS_APP_REBASE_CC:
        return adcs_rebase(StatePtr, Rebase->ShiftS);
    default:
        return adcs_restart_estimators(StatePtr);
    }
}

void ADCS_APP_ProcessGroundCommand(const CFE_SB_Buffer_t *SBBufPtr)
{
    CFE_MSG_FcnCode_t Code = 0;
    size_t Length;
    CFE_MSG_GetFcnCode(&SBBufPtr->Msg, &Code);
    Length = ADCS_APP_LengthOf(Code);
    if (Length == 0) {
        ADCS_APP_Data.ErrCounter++;
        CFE_EVS_SendEvent(ADCS_APP_CC_ERR_EID, CFE_EVS_EventType_ERROR,
            "ADCS_APP: invalid command code %u", (unsigned int)Code);
    } else if (!ADCS_APP_VerifyLength(SBBufPtr, Length)) {
        /* it was said */
    } else if (Code == ADCS_APP_RESET_COUNTERS_CC) {
        ADCS_APP_ResetCounters();
    } else if (Code == ADCS_APP_NOOP_CC) {
        ADCS_APP_Data.CmdCounter++;
        CFE_EVS_SendEvent(ADCS_APP_NOOP_INF_EID, CFE_EVS_EventType_INFORMATION,
            "ADCS_APP: no-op, %s", adcs_fingerprint());
    } else {
        ADCS_APP_Answer(Code, ADCS_APP_Carry(SBBufPtr, Code));
    }
}
