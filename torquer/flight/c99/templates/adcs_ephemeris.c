/* Kernels of the ephemeris on board of $name, exported by torquer $version. */
#include "adcs_ephemeris.h"
$portable#ifdef ADCS_PORTABLE
#include "adcs_math.h"
#endif

#include <float.h>
$includes
$checks
$types
$constants
$program
void adcs_first_elements(adcs_elements *elements)
{
    static const adcs_elements first = {
$first    };
    *elements = first;
}

bool adcs_ephemeris(const adcs_elements *elements, adcs_inputs *inputs)
{
$given    const eph_Ephemeris found = $kernel($arguments);
    for (int32_t k = 0; k < 3; k++) {
        inputs->r_inertial_m[k] = found.r_inertial_m.v[k];
        inputs->v_inertial_m_s[k] = found.v_inertial_m_s.v[k];
        inputs->b_inertial_t[k] = found.b_inertial_t.v[k];
        inputs->b_rate_inertial_t_s[k] = found.b_rate_inertial_t_s.v[k];
        inputs->sun_inertial[k] = found.sun_inertial.v[k];
    }
    inputs->sunlit_fraction = found.sunlit_fraction;
    return isfinite(found.b_inertial_t.v[0]) && isfinite(found.sunlit_fraction);
}

$exact
bool adcs_ephemeris_is_exact(void)
{
#ifdef ADCS_PORTABLE
    const bool is_math_exact = adcs_math_is_exact();
#else
    const bool is_math_exact = true;
#endif
    return $is_exact && is_math_exact;
}
