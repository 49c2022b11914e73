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
    return sums && quotients && small_numbers && zeros && no_numbers;
}
