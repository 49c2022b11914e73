/* Functions of angles whose bits are the same with every C library, for builds with ADCS_PORTABLE:
   the double nearest to the true value, but for about one argument in 10^8 or more. */
#ifndef ADCS_MATH_H
#define ADCS_MATH_H

#ifdef __cplusplus
extern "C" {
#endif

$prototypes
#ifdef __cplusplus
}
#endif

#endif
