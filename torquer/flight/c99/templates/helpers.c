/* a % b as Python has it: the sign is that of b */
static double floor_mod(double a, double b)
{
    double rest = fmod(a, b);
    if (b == 0.0) {
        return rest;
    }
    if (rest != 0.0) {
        if ((b < 0.0) != (rest < 0.0)) {
            rest += b;
        }
    } else {
        rest = copysign(0.0, b);
    }
    return rest;
}

/* quotient as Python rounds it: the greatest whole number that is not above it */
static double floor_div(double a, double b)
{
    const double rest = fmod(a, b);
    double quotient = (a - rest) / b;
    double whole;
    if (b == 0.0) {
        return a / b;
    }
    if (rest != 0.0 && (b < 0.0) != (rest < 0.0)) {
        quotient -= 1.0;
    }
    if (quotient == 0.0) {
        return copysign(0.0, a / b);
    }
    whole = floor(quotient);
    if (quotient - whole > 0.5) {
        whole += 1.0;
    }
    return whole;
}

/* quotient of whole numbers as Python has it: rounded down; 0 where b is 0, or where it is beyond
   64 bits, as in the simulation */
static int64_t floor_div_int(int64_t a, int64_t b)
{
    const bool is_defined = (b != 0) && ((a != INT64_MIN) || (b != -1));
    const int64_t quotient = is_defined ? a / b : 0;
    return (is_defined && (a % b != 0) && ((a < 0) != (b < 0))) ? quotient - 1 : quotient;
}

/* a % b of whole numbers as Python has it: the sign is that of b; 0 where b is 0 */
static int64_t floor_mod_int(int64_t a, int64_t b)
{
    const int64_t rest = ((b != 0) && (b != -1)) ? a % b : 0;
    return ((rest != 0) && ((rest < 0) != (b < 0))) ? rest + b : rest;
}

/* a ** b by the library, whatever a compiler knows of the two */
static REAL power_of(REAL a, REAL b)
{
    const volatile double base = TO_DOUBLEa;
    const volatile double exponent = TO_DOUBLEb;
    return TO_REALpow(base, exponent);
}

/* the first of two numbers unless the second is less: what Python does with NaN and -0.0 */
static double min_of(double a, double b)
{
    return (b < a) ? b : a;
}

/* the first of two numbers unless the second is greater: what Python does with NaN and -0.0 */
static double max_of(double a, double b)
{
    return (b > a) ? b : a;
}

/* the lesser of two whole numbers */
static int64_t min_of_int(int64_t a, int64_t b)
{
    return (b < a) ? b : a;
}

/* the greater of two whole numbers */
static int64_t max_of_int(int64_t a, int64_t b)
{
    return (b > a) ? b : a;
}

/* magnitude of a whole number; the least one has none and stays as it is */
static int64_t abs_int(int64_t a)
{
    return ((a < 0) && (a != INT64_MIN)) ? -a : a;
}

/* sum of whole numbers, which wraps beyond 64 bits */
static int64_t sum_of_int(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a + (uint64_t)b);
}

/* difference of whole numbers, which wraps beyond 64 bits */
static int64_t difference_of_int(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a - (uint64_t)b);
}

/* product of whole numbers, which wraps beyond 64 bits */
static int64_t product_of_int(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a * (uint64_t)b);
}

/* what a counter counts after k, which is below the end: the end where it would go past that */
static int64_t next_up(int64_t k, int64_t step, int64_t end)
{
    return ((uint64_t)end - (uint64_t)k > (uint64_t)step) ? k + step : end;
}

/* what a counter that counts down counts after k, which is above the end */
static int64_t next_down(int64_t k, int64_t step, int64_t end)
{
    return ((uint64_t)k - (uint64_t)end > (uint64_t)step) ? k - step : end;
}

/* -1, 0 or 1 by the sign of a number, NaN of NaN, as NumPy's sign */
static double sign_of(double a)
{
    if (isnan(a) != 0) {
        return a;
    }
    return (a > 0.0) ? 1.0 : ((a < 0.0) ? -1.0 : 0.0);
}

/* a without its fraction; of NaN and of numbers beyond 64 bits the least whole number */
static int64_t int_of(double a)
{
    const double least = -9.223372036854775808e18;
    return (int64_t)(((a >= least) && (a < -least)) ? a : least);
}

/* place of an index among n: a negative one counts from the end, as in Python; one that is beyond
   both ends, of a state that is damaged, is the first */
static int64_t place_of(int64_t index, int64_t n)
{
    const int64_t place = (index < 0) ? index + n : index;
    return ((uint64_t)place < (uint64_t)n) ? place : 0;
}

/* zero if three numbers are finite, else no number; by their words where functions compute with
   doubles, which are slow */
static double doubt_of_three(double a, double b, double c)
{
#if defined(__SOFTFP__) || (defined(__ARM_FP) && (__ARM_FP & 8) == 0) || \
    (defined(__riscv) && !defined(__riscv_flen))
    return ((isfinite(a) != 0) && (isfinite(b) != 0) && (isfinite(c) != 0)) ? 0.0 : (double)NAN;
#else
    return (0.0 * a) + (0.0 * b) + (0.0 * c);
#endif
}
