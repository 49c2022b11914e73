/* Message ids of the app of $name, exported by torquer $version: those of your mission come first. */
#ifndef ADCS_APP_MSGIDS_H
#define ADCS_APP_MSGIDS_H

/* Commands from the ground, a request for housekeeping, a tick of the control cycle. */
#ifndef ADCS_APP_CMD_MID
#define ADCS_APP_CMD_MID 0x18A0
#endif
#ifndef ADCS_APP_SEND_HK_MID
#define ADCS_APP_SEND_HK_MID 0x18A1
#endif
#ifndef ADCS_APP_WAKEUP_MID
#define ADCS_APP_WAKEUP_MID 0x18A2
#endif

/* The latest readings, from who reads the sensors; housekeeping; what coils and wheels are to make. */
#ifndef ADCS_APP_INPUTS_MID
#define ADCS_APP_INPUTS_MID 0x08A0
#endif
#ifndef ADCS_APP_HK_TLM_MID
#define ADCS_APP_HK_TLM_MID 0x08A1
#endif
#ifndef ADCS_APP_ACTUATORS_MID
#define ADCS_APP_ACTUATORS_MID 0x08A2
#endif

#endif
