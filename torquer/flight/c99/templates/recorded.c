/* The first recorded control steps, for a replay with ADCS_RECORDED on a board without files. */
#include <stddef.h>
#include <stdint.h>

extern const uint64_t adcs_recorded[];
extern const size_t adcs_recorded_words;

const size_t adcs_recorded_words = $words;
const uint64_t adcs_recorded[$words] = {
    $rows
};
