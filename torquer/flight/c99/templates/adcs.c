/* Kernels of the on-board computer of $name, exported by torquer $version. */
#include "adcs_types.h"
#ifdef ADCS_PORTABLE
#include "adcs_math.h"
#endif
$include_ephemeris
$program
/* A target on which a state is not as the header says: the file does not compile. */
typedef struct {
    char first;
    Held held;
} beside_held;
typedef struct {
    char first;
    adcs_state state;
} beside_state;
typedef char state_has_its_size[(sizeof(Held) == sizeof(adcs_state)) ? 1 : -1];
typedef char state_is_aligned[
    (offsetof(beside_held, held) <= offsetof(beside_state, state)) ? 1 : -1];

static const Held *held_by(const adcs_state *state)
{
    return (const Held *)state;
}

/* Whether a state was begun by this export: what else is in it is looked at only then. */
static bool is_begun(const adcs_state *state)
{
    return held_by(state)->version == ADCS_STATE_VERSION;
}

/* What a state holds; of one that was not begun what it would hold then. */
static const OnBoard *seen(const adcs_state *state)
{
    return is_begun(state) ? &held_by(state)->now : adcs_first();
}

/* What a state holds, to be changed: no seal is true any more. NULL for one that was not begun. */
static OnBoard *opened(adcs_state *state)
{
    Held *held = (Held *)state;
    if (!is_begun(state)) {
        return NULL;
    }
    held->seal = 0;
    return &held->now;
}

/* Mark of all numbers of a state, never 0. No step of it loses a bit: one word that is another one
   is always seen. */
static uint64_t mark_of(const OnBoard *own)
{
    const unsigned char *bytes = (const unsigned char *)own;
    uint64_t mark = 0xcbf29ce484222325u;
    for (size_t k = 0; k < sizeof *own; k += sizeof mark) {
        uint64_t word = 0;
        for (size_t n = k; n < k + sizeof word; n++) {
            word = (word << 8) | bytes[n];
        }
        mark = (mark ^ word) * 0x100000001b3u;
        mark ^= mark >> 29;
    }
    return (mark != 0u) ? mark : 1u;
}

$is_region/* A control step: what it answers, and what its laws have asked for. */
static Answer answered(OnBoard *own, const adcs_inputs *inputs)
{
    Given given;
    Answer answer;
${before_step}$copies    answer = $call_gated_step;
${after_step}    return answer;
}

uint32_t adcs_step(adcs_state *state, const adcs_inputs *inputs, adcs_command *command)
{
    OnBoard *const own = opened(state);
    Answer answer;
    if (own == NULL) {
        const adcs_command none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        *command = none;
        return ADCS_MET_NOT_BEGUN;
    }
    answer = answered(own, inputs);
    for (int32_t k = 0; k < 3; k++) {
        command->dipole_a_m2[k] = ${to_double}answer.dipole_a_m2.v[k];
        command->torque_n_m[k] = ${to_double}answer.torque_n_m.v[k];
    }
    return (uint32_t)answer.status;
}

$exact
/* Whether numbers have the words of IEEE 754, their bytes in the order of those of whole numbers. */
static bool are_words_in_order(void)
{
    const uint64_t word = 0xc00921fb54442d18u;
    volatile double hidden = -3.141592653589793;
    const double number = hidden;
    const uint8_t *expected = (const uint8_t *)&word;
    const uint8_t *found = (const uint8_t *)&number;
    bool same = sizeof(double) == sizeof word && sizeof(float) == 4u;
    for (size_t k = 0; same && (k < sizeof word); k++) {
        same = expected[k] == found[k];
    }
    return same;
}

bool adcs_self_test(void)
{
#ifdef ADCS_PORTABLE
    const bool is_math_exact = adcs_math_is_exact();
#else
    const bool is_math_exact = true;
#endif
    return $is_exact && are_words_in_order() && is_math_exact$is_ephemeris_exact;
}

void adcs_seal_state(adcs_state *state)
{
    Held *held = (Held *)state;
    held->seal = mark_of(&held->now);
}

adcs_integrity adcs_check_state(const adcs_state *state)
{
    const Held *held = held_by(state);
    if (!is_begun(state)) {
        return ADCS_OF_ANOTHER_EXPORT;
    }
    if (held->seal == 0u) {
        return ADCS_NOT_SEALED;
    }
    return (held->seal == mark_of(&held->now)) ? ADCS_SOUND : ADCS_DAMAGED;
}

int32_t adcs_mode(const adcs_state *state, int32_t region)
{
${unread_region}    return $mode;
}

int64_t adcs_failures(const adcs_state *state, int64_t *line)
{
$failures}

double adcs_logged(const adcs_state *state, int32_t cell)
{
$logged}

bool adcs_is_active(const adcs_state *state, int32_t law)
{
    const OnBoard *own = seen(state);
    (void)own;
    (void)law;
    return $call_is_active;
}

int32_t adcs_estimator(const adcs_state *state)
{
    const OnBoard *own = seen(state);
    (void)own;
    return (int32_t)$call_active_estimator;
}

bool adcs_is_tripped(const adcs_state *state, int32_t region)
{
    const OnBoard *own = seen(state);
    (void)own;
    (void)region;
    return $call_is_tripped;
}

void adcs_telemetry(const adcs_state *state, const adcs_inputs *inputs,
    const adcs_command *command, adcs_report *out)
{
$telemetry}

uint32_t adcs_met(const adcs_state *state)
{
    const double status = seen(state)->gate[0].status;
    const bool is_word = status >= 0.0 && status < 4294967296.0;
    return !is_begun(state) ? ADCS_MET_NOT_BEGUN : (is_word ? (uint32_t)status : 0u);
}

adcs_estimate adcs_estimated(const adcs_state *state)
{
    const adcs_estimate estimate = {$estimated};
    (void)state;
    return estimate;
}

int32_t adcs_commanded_mode(const adcs_state *state, int32_t region)
{
${unread_region}    return $commanded;
}

double adcs_clock_offset_s(const adcs_state *state)
{
    return seen(state)->gate[0].offset_s;
}

bool adcs_is_held(const adcs_state *state, int32_t region)
{
${unread_region}    return $held;
}

bool adcs_flag(const adcs_state *state, int32_t flag)
{
$flag}

double adcs_parameter(const adcs_state *state, int32_t place)
{
$parameter}

adcs_outcome adcs_command_mode(adcs_state *state, int32_t region, int32_t mode)
{
    OnBoard *const own = opened(state);
    (void)region;
    (void)mode;
    return (own == NULL) ? ADCS_NOT_BEGUN : (adcs_outcome)$call_command_mode;
}

adcs_outcome adcs_hold(adcs_state *state, int32_t region, bool on)
{
    OnBoard *const own = opened(state);
    (void)region;
    (void)on;
    return (own == NULL) ? ADCS_NOT_BEGUN : (adcs_outcome)$call_hold;
}

adcs_outcome adcs_set_flag(adcs_state *state, int32_t flag, bool on)
{
    OnBoard *const own = opened(state);
    (void)flag;
    (void)on;
    return (own == NULL) ? ADCS_NOT_BEGUN : (adcs_outcome)$call_set_flag;
}

adcs_outcome adcs_set_parameter(adcs_state *state, int32_t place, double value)
{
    OnBoard *const own = opened(state);
    (void)place;
    (void)value;
    return (own == NULL) ? ADCS_NOT_BEGUN : (adcs_outcome)$call_set_parameter;
}

adcs_outcome adcs_rebase(adcs_state *state, double shift_s)
{
    OnBoard *const own = opened(state);
    return (own == NULL) ? ADCS_NOT_BEGUN : (adcs_outcome)$call_rebase;
}

adcs_outcome adcs_restart_estimators(adcs_state *state)
{
    OnBoard *const own = opened(state);
    if (own == NULL) {
        return ADCS_NOT_BEGUN;
    }
    $call_restart_estimators;
    return ADCS_DONE;
}
