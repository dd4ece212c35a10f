/* What operations mean: the order of operations and the rule for non-finite results are part of the definition. */

static inline uint32_t bits_of(float x)
{
    union { float value; uint32_t bits; } word = { x };
    return word.bits;
}

static inline float float_of(uint32_t bits)
{
    union { uint32_t bits; float value; } word = { bits };
    return word.value;
}

static inline float op_abs(float x) { return float_of(bits_of(x) & 0x7fffffffu); }

/* A non-finite result becomes +0. */
static inline float or_zero(float x) { return op_abs(x) <= FLT_MAX ? x : 0.0f; }

/* The rule of the classic set: NaN becomes +0, infinities the largest number of their sign. */
static inline float limited(float x)
{
    return x > FLT_MAX ? FLT_MAX : x < -FLT_MAX ? -FLT_MAX : x == x ? x : 0.0f;
}

static inline float clamp(float x, float low, float high) { return x < low ? low : x > high ? high : x; }

static inline float op_add(float x, float y) { return or_zero(x + y); }

static inline float op_sub(float x, float y) { return or_zero(x - y); }

static inline float op_mul(float x, float y) { return or_zero(x * y); }

static inline float op_div(float x, float y) { return or_zero(x / y); }

static inline float op_min(float x, float y) { return x < y ? x : y; }

static inline float op_max(float x, float y) { return x > y ? x : y; }

static inline float op_recip(float x) { return or_zero(1.0f / x); }

static inline float op_sqr(float x) { return or_zero(x * x); }

static inline float op_cube(float x) { return or_zero((x * x) * x); }

static inline float op_heaviside(float x) { return x >= 0.0f ? 1.0f : 0.0f; }

static inline float op_cond(float old, float x, float y) { return old < x ? -y : old; }

static inline float op_same(float x) { return x; }

static inline float op_latch(float old, float x, float y) { return x > 0.0f ? y : old; }

static inline float op_classic_add(float x, float y) { return limited(x + y); }

static inline float op_classic_sub(float x, float y) { return limited(x - y); }

static inline float op_classic_neg(float x, float y) { return x < y ? -x : x; }

static inline float op_classic_mult(float x) { return limited(x * 2.0f); }

static inline float op_classic_div(float x) { return limited(x / 2.0f); }
