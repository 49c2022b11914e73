/* Types of the kernels, for the library's own files; an adcs_state holds a Held. */
#ifndef ADCS_TYPES_H
#define ADCS_TYPES_H

#include "adcs.h"

#include <float.h>
$includes
$checks
/* Constants are doubles: -fsingle-precision-constant makes floats of them. */
typedef char constants_are_doubles[(sizeof(0.1) == sizeof(double)) ? 1 : -1];

$types
/* What an adcs_state holds. `version`: ADCS_STATE_VERSION; `seal`: of adcs_seal_state, 0: none. */
typedef struct {
    uint64_t version;
    uint64_t seal;
    OnBoard now;
} Held;

/* What a state holds that has just been begun. */
const OnBoard *adcs_first(void);

/* Constants of the computer. */
const $computer *adcs_constants(void);

/* What the boundary checks by. */
const Gate *adcs_gate(void);

#endif
