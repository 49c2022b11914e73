/* Whether products are rounded before they are added to in one place of a table and taken from in
   the next: vectorisers fuse such pairs, GCC's with -ffp-contract=off, too. */
static bool are_${real}_pairs_exact(void)
{
    const volatile $real part = $part$f;
    const volatile size_t count = 4;
    $real x[4] = {0.0$f, 0.0$f, 0.0$f, 0.0$f};
    $real y[4] = {0.0$f, 0.0$f, 0.0$f, 0.0$f};
    $real less_first[4];
    $real more_first[4];
    $real *volatile hidden_x = x; /* or GCC keeps them in registers and fuses nothing here alone */
    $real *volatile hidden_y = y;
    bool same = true;
    for (size_t k = 0; k < count; k++) { /* a count that no compiler knows keeps them in memory */
        const $real rounded = (2.0$f * part) + 1.0$f;
        x[k] = part + 1.0$f;
        y[k] = ((k & 1u) == 0u) ? rounded : -rounded;
    }
    const $real *const u = hidden_x;
    $real *const w = hidden_y;
    less_first[0] = (u[0] * u[0]) - w[0];
    less_first[1] = (u[1] * u[1]) + w[1];
    less_first[2] = (u[2] * u[2]) - w[2];
    less_first[3] = (u[3] * u[3]) + w[3];
    for (size_t k = 0; k < count; k++) {
        same = same && less_first[k] == 0.0$f;
        w[k] = -w[k];
    }
    more_first[0] = (u[0] * u[0]) + w[0];
    more_first[1] = (u[1] * u[1]) - w[1];
    more_first[2] = (u[2] * u[2]) + w[2];
    more_first[3] = (u[3] * u[3]) - w[3];
    for (size_t k = 0; k < count; k++) {
        same = same && more_first[k] == 0.0$f;
    }
    return same;
}

/* Whether products, sums and quotients of ${real}s are rounded one by one and in their order, no
   zero stands for small numbers, and NaN, infinities and the signs of zeros are seen. What is
   volatile no compiler knows. */
static bool are_${real}s_exact(void)
{
    volatile $real hidden[9] = {1.0$f, 3.0$f, 0.0$f, $part$f, $least$f, 0x1p60$f, 5.0$f, 7.0$f,
        ($real)NAN};
    const $real one = hidden[0];
    const $real three = hidden[1];
    const $real zero = hidden[2];
    const $real x = one + hidden[3];
    const $real y = -(one + (2.0$f * hidden[3]));
    const $real least = hidden[4];
    const $real large = hidden[5];
    const $real five = hidden[6];
    const $real seven = hidden[7];
    const $real none = hidden[8];
    const $real small = least * large;
    const bool sums = (x * x) + y == 0.0$f && (one + large) - large == 0.0$f;
    const bool quotients = five / 3.0$f == 1.6666666666666667$f &&
        five / three == 1.6666666666666667$f && seven / three == 2.3333333333333335$f &&
        (five + five) / three == 3.3333333333333335$f;
    const bool small_numbers = least * one > 0.0$f && small / large == least && small > 0.0$f;
    const bool zeros = signbit(zero) == 0 && signbit(-zero) != 0 && signbit(-zero + zero) == 0;
    const bool no_numbers = isnan(none) != 0 && none != none && !(none <= zero) &&
        isinf(one / zero) != 0 && isnan((one / zero) * zero) != 0;
    return sums && quotients && small_numbers && zeros && no_numbers && are_${real}_pairs_exact();
}
