/* Messages of the app of $name, exported by torquer $version. */
#ifndef ADCS_APP_MSG_H
#define ADCS_APP_MSG_H

#include "cfe.h"

#include "adcs.h"

/* Function codes of commands. */
#define ADCS_APP_NOOP_CC 0
#define ADCS_APP_RESET_COUNTERS_CC 1
#define ADCS_APP_COMMAND_MODE_CC 2
#define ADCS_APP_HOLD_CC 3
#define ADCS_APP_SET_FLAG_CC 4
#define ADCS_APP_SET_PARAMETER_CC 5
#define ADCS_APP_REBASE_CC 6
#define ADCS_APP_RESTART_ESTIMATORS_CC 7

/* A command without arguments: no-op, reset of counters, restart of the estimators, wake-up,
   request for housekeeping. */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
} ADCS_APP_NoArgsCmd_t;

/* A region (ADCS_REGION_...) and the state (ADCS_STATE_...) that it is to enter. */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    int32 Region;
    int32 Mode;
} ADCS_APP_CommandModeCmd_t;

/* A region whose transitions are kept (1), or a flag (ADCS_FLAG_...) that is raised (1). */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    int32 Which;
    uint32 On;
} ADCS_APP_SwitchCmd_t;

/* A number of a parameter (ADCS_PARAMETER_... and those that follow it). */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    int32 Place;
    uint32 Spare;
    double Value;
} ADCS_APP_SetParameterCmd_t;

/* By how much the clock of the inputs has been set forward [s]. */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    double ShiftS;
} ADCS_APP_RebaseCmd_t;

/* The latest readings: see adcs_inputs. They answer a wake-up, after the coils were told to be off. */
typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    adcs_inputs Payload;
} ADCS_APP_InputsMsg_t;

/* What coils and wheels are to make until the next one, body axes. */
typedef struct {
    double DipoleAm2[3];
    double TorqueNm[3];
} ADCS_APP_Actuators_Payload_t;

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    ADCS_APP_Actuators_Payload_t Payload;
} ADCS_APP_ActuatorsMsg_t;

/* Housekeeping. */
typedef struct {
    uint8 CommandCounter;
    uint8 CommandErrorCounter;
    uint16 Spare;
    uint32 Steps;  /* control steps that were taken */
    uint32 Missed; /* control steps that had no inputs */
    uint32 Met;    /* what the last step has met: ADCS_MET_... */
    int64_t Failures;    /* what has failed since the start: ADCS_FAILED_... */
    int64_t FailureLine; /* where in its file */
    adcs_command Command;   /* what the laws command */
    adcs_estimate Estimate; /* after the last step */
$mode_members} ADCS_APP_HkTlm_Payload_t;

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    ADCS_APP_HkTlm_Payload_t Payload;
} ADCS_APP_HkTlm_t;

#endif
