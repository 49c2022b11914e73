/* Performance id of the app of $name, exported by torquer $version. */
#ifndef ADCS_APP_PERFIDS_H
#define ADCS_APP_PERFIDS_H

#ifndef ADCS_APP_PERF_ID
#define ADCS_APP_PERF_ID 91
#endif

#endif
