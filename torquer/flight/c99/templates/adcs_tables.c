/* Parameters, mode tables and first state of the on-board computer of $name. */
#include "adcs_types.h"

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

static const Held first = {ADCS_STATE_VERSION, 0u, $first};

const OnBoard *adcs_first(void)
{
    return &first.now;
}

const char *adcs_fingerprint(void)
{
    return "$fingerprint";
}

const char *adcs_mode_name(int32_t mode)
{
$mode_names}

uint32_t adcs_interface_version(void)
{
    return ADCS_INTERFACE_VERSION;
}

void adcs_init(adcs_state *state)
{
    *(Held *)state = first;
}
