#if FLT_EVAL_METHOD != 0
#error "doubles must be computed as doubles: on x86 compile with -msse2 -mfpmath=sse"
#endif
#if defined(__FAST_MATH__)
#error "compile without -ffast-math: other bits, and NaN is not seen"
#endif
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0
#error "compile without -ffinite-math-only: NaN is not seen"
#endif
#if defined(__RECIPROCAL_MATH__)
#error "compile without -freciprocal-math: quotients have other bits"
#endif
#if defined(__ASSOCIATIVE_MATH__)
#error "compile without -fassociative-math: sums have other bits"
#endif
#if defined(__NO_SIGNED_ZEROS__)
#error "compile without -fno-signed-zeros: zeros have signs"
#endif
