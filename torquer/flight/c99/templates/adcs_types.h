/* Types of the kernels; those of memory are places in the state. */
#ifndef ADCS_TYPES_H
#define ADCS_TYPES_H

$includes
$types
/* Constants of the computer. */
const $computer *adcs_constants(void);

/* What the boundary checks by. */
const Gate *adcs_gate(void);

#endif
