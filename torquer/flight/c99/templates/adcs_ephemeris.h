/* The ephemeris on board of $name, exported by torquer $version.

   The model field, the direction to the Sun and its light
   $how.
   Inertial axes are $axes. All is computed in double precision. */
#ifndef ADCS_EPHEMERIS_H
#define ADCS_EPHEMERIS_H

#include "adcs.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Numbers that the ground may send up; all that changes. */
typedef struct {
$members} adcs_elements;

/* Elements as at the start of the scenario. */
void adcs_first_elements(adcs_elements *elements);

/* Set r_inertial_m to sunlit_fraction of the inputs for their t_s$place.
   False, with NaN in position, velocity, field and Sun, where there is no place$nowhere. */
bool adcs_ephemeris(const adcs_elements *elements, adcs_inputs *inputs);

/* Whether this file is compiled to compute with its bits: adcs_self_test() asks it. */
bool adcs_ephemeris_is_exact(void);

#ifdef __cplusplus
}
#endif

#endif
