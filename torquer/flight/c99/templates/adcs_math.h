/* Functions of angles whose bits are the same with every C library, for builds with ADCS_PORTABLE:
   the double nearest to the true value, but for about one argument in 10^8 or more. */
#ifndef ADCS_MATH_H
#define ADCS_MATH_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

$prototypes
/* Whether this file is compiled to compute with its bits: adcs_self_test() asks it. */
bool adcs_math_is_exact(void);

#ifdef __cplusplus
}
#endif

#endif
