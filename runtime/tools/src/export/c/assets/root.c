#if defined(__GNUC__) && !defined(TPG_NO_ASSEMBLY)
#define TPG_ASSEMBLY
#endif
/* The correctly rounded square root; 0 for negative numbers. By the processor's instruction where there is one, else
   digit by digit: 24 binary digits of the result and one to round by. */
static inline float op_sqrt(float x)
{
    if (!(x > 0.0f)) return x == 0.0f ? x : 0.0f;
    if (!(x <= FLT_MAX)) return 0.0f;
#if defined(TPG_ASSEMBLY) && defined(__aarch64__)
    float root;
    __asm__("fsqrt %s0, %s1" : "=w"(root) : "w"(x));
    return root;
#elif defined(TPG_ASSEMBLY) && defined(__ARM_FP) && (__ARM_FP & 4)
    float root;
    __asm__("vsqrt.f32 %0, %1" : "=t"(root) : "t"(x));
    return root;
#elif defined(TPG_ASSEMBLY) && defined(__riscv_flen)
    float root;
    __asm__("fsqrt.s %0, %1" : "=f"(root) : "f"(x));
    return root;
#elif defined(TPG_ASSEMBLY) && defined(__SSE__)
    float root;
    __asm__("sqrtss %1, %0" : "=x"(root) : "x"(x));
    return root;
#else
    uint32_t mantissa = bits_of(x) & 0x007fffffu;
    int exponent = (int)(bits_of(x) >> 23);
    if (exponent != 0) {
        mantissa |= 0x00800000u;
    } else {
        exponent = 1;
        while (mantissa < 0x00800000u) {
            mantissa <<= 1;
            exponent--;
        }
    }
    exponent -= 127;
    if (exponent % 2 != 0) {
        mantissa <<= 1;
        exponent--;
    }
    mantissa <<= 7;
    uint32_t root = 0, rest = 0;
    for (int k = 0; k < 25; k++) {
        rest = rest << 2 | mantissa >> 30;
        mantissa <<= 2;
        const uint32_t trial = root << 2 | 1u;
        root <<= 1;
        if (rest >= trial) {
            rest -= trial;
            root |= 1u;
        }
    }
    return float_of(((uint32_t)(exponent / 2 + 126) << 23) + ((root + 1u) >> 1));
#endif
}
