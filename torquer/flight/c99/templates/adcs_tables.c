/* Parameters, mode tables and first state of the on-board computer of $name. */
#include "adcs.h"

$constants
const $computer *adcs_constants(void)
{
    return &constants;
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
