/* Parameters of $name at the start, exported by torquer $version. */
#include "cfe_tbl_filedef.h"

#include "adcs_app_tbl.h"

ADCS_APP_ParametersTbl_t ADCS_APP_ParametersTbl = {
    ADCS_APP_TBL_NUMBERS,
    0$table_values
};

CFE_TBL_FILEDEF(ADCS_APP_ParametersTbl, ADCS_APP.Parameters, ADCS parameters, adcs_app_tbl.tbl)
