/* Parameters, mode tables and first state of the on-board computer of $name. */
#include "adcs.h"

$constants
$gate
const $computer *adcs_constants(void)
{
    return &constants;
}

const Gate *adcs_gate(void)
{
    return &gate;
}

$first
const char *adcs_fingerprint(void)
{
    return "$fingerprint";
}

void adcs_init(adcs_state *state)
{
    *state = first;
}
