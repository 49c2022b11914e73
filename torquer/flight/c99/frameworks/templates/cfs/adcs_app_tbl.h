/* The table of parameters of $name, exported by torquer $version, in SI. */
#ifndef ADCS_APP_TBL_H
#define ADCS_APP_TBL_H

#include "cfe.h"

/* Numbers in the table; one of another export is refused. */
#define ADCS_APP_TBL_NUMBERS $numbers

typedef struct {
    uint32 Numbers;
    uint32 Spare;
$table_members} ADCS_APP_ParametersTbl_t;

#endif
