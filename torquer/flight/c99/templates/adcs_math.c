/* Functions of angles, the same bits with every C library; exported by torquer $version. */
#include "adcs_math.h"

$includes
$program