/* Events of the app of $name, exported by torquer $version. */
#ifndef ADCS_APP_EVENTS_H
#define ADCS_APP_EVENTS_H

#define ADCS_APP_STARTUP_INF_EID 1
#define ADCS_APP_NOOP_INF_EID 2
#define ADCS_APP_RESET_INF_EID 3
#define ADCS_APP_DONE_INF_EID 4
#define ADCS_APP_REFUSED_ERR_EID 5
#define ADCS_APP_CC_ERR_EID 6
#define ADCS_APP_MID_ERR_EID 7
#define ADCS_APP_LEN_ERR_EID 8
#define ADCS_APP_PIPE_ERR_EID 9
#define ADCS_APP_TBL_INF_EID 10
#define ADCS_APP_TBL_ERR_EID 11
#define ADCS_APP_MISSING_ERR_EID 12
#define ADCS_APP_LAW_ERR_EID 13

/* What a step has met: bit k of ADCS_MET_... is the event of this id and k. */
#define ADCS_APP_MET_FIRST_EID 32
#define ADCS_APP_MET_COUNT $met_count

/* How many of a kind go out until ADCS_APP_RESET_COUNTERS_CC. Binary filters of EVS would do as much,
   but by default there are 8 for an app. */
#ifndef ADCS_APP_EVENTS_OF_A_KIND
#define ADCS_APP_EVENTS_OF_A_KIND 16
#endif

#endif
