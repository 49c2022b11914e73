/* Functions of angles, the same bits with every C library; exported by torquer $version. */
#include "adcs_math.h"

#include <float.h>
$includes
$checks
$program
$exact
bool adcs_math_is_exact(void)
{
    return $is_exact;
}
