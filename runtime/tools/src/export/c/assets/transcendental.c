static inline float power_of_two(int32_t n) { return float_of((uint32_t)(n + 127) << 23); }

/* x times the n-th power of two, rounded once. x is between a half and two, n between -150 and 128. */
static float scaled(float x, int32_t n)
{
    if (n > 127) return x * 2.0f * power_of_two(n - 1);
    if (n < -126) return x * power_of_two(n + 100) * power_of_two(-100);
    return x * power_of_two(n);
}

/* The multiple of log 2 that reduces x. Near zero it is the sign of x or nothing. */
static inline int32_t halvings(float x)
{
    const float size = op_abs(x);
    const float sign = x < 0.0f ? -1.0f : 1.0f;
    if (size <= 0x1.62e430p-2f) return 0;
    return (int32_t)(size < 0x1.0a2b24p0f ? sign : 0x1.715476p0f * x + 0.5f * sign);
}

/* Infinite where it overflows. Coefficients and order of operations are those of fdlibm (Sun Microsystems, 1993), as in
   the Rust crate libm. */
static float exponential(float x)
{
    if (x >= 0x1.62e430p6f) return x * 0x1.000000p127f;
    if (!(x > -0x1.9fe36ap6f)) return x == x ? 0.0f : x;
    const int32_t n = halvings(x);
    if (op_abs(x) <= 0x1.000000p-13f) return 1.0f + x;
    const float high = x - (float)n * 0x1.62e400p-1f;
    const float low = (float)n * 0x1.7f7d1cp-20f;
    const float r = high - low;
    const float square = r * r;
    const float c = r - square * (0x1.55551ep-3f + square * -0x1.6aa42ap-9f);
    return scaled(1.0f + (r * c / (2.0f - c) - low + high), n);
}

static inline float op_exp(float x) { return or_zero(exponential(x)); }

static inline float op_classic_exp(float x) { return limited(exponential(x)); }

/* Of a positive number. Coefficients and order of operations are those of fdlibm (Sun Microsystems, 1993), as in
   the Rust crate libm. */
static float logarithm(float x)
{
    if (!(x <= FLT_MAX)) return x;
    const bool subnormal = x < FLT_MIN;
    /* The mantissa is taken between the root of a half and the root of two. */
    const uint32_t bits = bits_of(subnormal ? x * 0x1.000000p25f : x) + (0x3f800000u - 0x3f3504f3u);
    const float n = (float)((int32_t)(bits >> 23) - (subnormal ? 152 : 127));
    const float f = float_of((bits & 0x007fffffu) + 0x3f3504f3u) - 1.0f;
    const float s = f / (2.0f + f);
    const float z = s * s;
    const float w = z * z;
    const float rest = z * (0x1.555554p-1f + w * 0x1.23d3dcp-2f) + w * (0x1.999c26p-2f + w * 0x1.f13c4cp-3f);
    const float half = 0.5f * f * f;
    return s * (half + rest) + n * 0x1.2fefa2p-17f - half + f + n * 0x1.62e300p-1f;
}

static inline float op_log(float x) { return x > 0.0f ? or_zero(logarithm(x)) : 0.0f; }

static inline float op_classic_log(float x, float y) { return y > 0.0f ? limited(logarithm(y)) : x; }

static inline float with_sign_of(float size, float x) { return float_of(bits_of(size) | (bits_of(x) & 0x80000000u)); }

/* Coefficients and order of operations are those of fdlibm (Sun Microsystems, 1993), as in
   the Rust crate libm. */
static float op_atan(float x)
{
    const float a = op_abs(x);
    if (!(a >= 0x1.000000p-12f)) return or_zero(x);
    if (a >= 0x1.000000p26f) return with_sign_of(0x1.921fb4p0f, x);
    /* The arc tangent of a is high + low + that of t. */
    float t = a, high = 0.0f, low = 0.0f;
    if (a >= 2.4375f) {
        t = -1.0f / a;
        high = 0x1.921fb4p0f;
        low = 0x1.4442d0p-24f;
    } else if (a >= 1.1875f) {
        t = (a - 1.5f) / (1.0f + 1.5f * a);
        high = 0x1.f730bcp-1f;
        low = 0x1.281f68p-25f;
    } else if (a >= 0.6875f) {
        t = (a - 1.0f) / (a + 1.0f);
        high = 0x1.921fb4p-1f;
        low = 0x1.4442d0p-25f;
    } else if (a >= 0.4375f) {
        t = (2.0f * a - 1.0f) / (2.0f + a);
        high = 0x1.dac670p-2f;
        low = 0x1.586ed2p-28f;
    }
    const float z = t * t;
    const float w = z * z;
    const float odd = z * (0x1.555552p-2f + w * (0x1.23ea1ap-3f + w * 0x1.f9584ap-5f));
    const float even = w * (-0x1.999530p-3f + w * -0x1.b4248ep-4f);
    return with_sign_of(high - ((t * (odd + even) - low) - t), x);
}

static float op_asin(float x)
{
    if (!(op_abs(x) <= 1.0f)) return 0.0f;
    return 2.0f * op_atan(x / (1.0f + op_sqrt((1.0f - x) * (1.0f + x))));
}

static float op_acos(float x) { return op_abs(x) <= 1.0f ? 0x1.921fb6p0f - op_asin(x) : 0.0f; }

/* The exponential less 1, for x from -0.52 to 20. Coefficients and order of operations are those of fdlibm (Sun Microsystems, 1993), as in
   the Rust crate libm. */
static float exponential_less_one(float x)
{
    if (op_abs(x) < 0x1.000000p-25f) return x;
    const int32_t n = halvings(x);
    const float high = x - (float)n * 0x1.62e300p-1f;
    const float low = (float)n * 0x1.2fefa2p-17f;
    const float r = high - low;
    const float lost = (high - r) - low;
    const float half = 0.5f * r;
    const float square = r * half;
    const float p = 1.0f + square * (-0x1.1110d0p-5f + square * 0x1.9e6020p-10f);
    const float t = 3.0f - p * half;
    float e = square * ((p - t) / (6.0f - r * t));
    if (n == 0) return r - (r * e - square);
    e = (r * (e - lost) - lost) - square;
    if (n == -1) return 0.5f * (r - e) - 0.5f;
    if (n == 1) return r < -0.25f ? -2.0f * (e - (r + 0.5f)) : 1.0f + 2.0f * (r - e);
    const float part = power_of_two(-n);
    const float sum = n < 23 ? r - e + (1.0f - part) : r - (e + part) + 1.0f;
    return sum * power_of_two(n);
}

static float op_tanh(float x)
{
    const float a = op_abs(x);
    if (!(a >= FLT_MIN)) return or_zero(x);
    float size = 1.0f;
    if (a <= 0x1.058af0p-2f) {
        const float t = exponential_less_one(-2.0f * a);
        size = -t / (t + 2.0f);
    } else if (a <= 10.0f) {
        const float t = exponential_less_one(2.0f * a);
        size = a <= 0x1.193ea8p-1f ? t / (t + 2.0f) : 1.0f - 2.0f / (t + 2.0f);
    }
    return with_sign_of(size, x);
}

/* The upper half of a number's mantissa: products of two such numbers are exact. */
static inline float upper(float x) { return float_of(bits_of(x) & 0xfffff000u); }

/* The binary logarithm of a number within 2^-20 of 1, as the sum of the result, which has an upper half only, and rest. */
static float log2_near_one(float a, float *rest)
{
    const float t = a - 1.0f;
    const float w = (t * t) * (0.5f - t * (0x1.555556p-2f - t * 0.25f));
    const float u = 0x1.715400p0f * t;
    const float v = t * 0x1.d94ae0p-18f - w * 0x1.715476p0f;
    const float sum = upper(u + v);
    *rest = v - (sum - u);
    return sum;
}

/* The same for any positive number. Coefficients and order of operations are those of fdlibm (Sun Microsystems, 1993), as in
   the Rust crate libm. */
static float log2_of(float a, float *rest)
{
    const bool subnormal = a < FLT_MIN;
    const uint32_t bits = bits_of(subnormal ? a * 0x1.000000p24f : a);
    int32_t exponent = (int32_t)(bits >> 23) - (subnormal ? 151 : 127);
    /* The mantissa is near 1 or near 1.5. */
    uint32_t mantissa = (bits & 0x007fffffu) | 0x3f800000u;
    const bool middle = mantissa > 0x3f9cc471u && mantissa < 0x3fddb3d7u;
    if (mantissa >= 0x3fddb3d7u) {
        mantissa -= 0x00800000u;
        exponent++;
    }
    const float x = float_of(mantissa);
    const float centre = middle ? 1.5f : 1.0f;
    const float u = x - centre;
    const float v = 1.0f / (x + centre);
    const float s = u * v;
    const float s_high = upper(s);
    const float sum_high = float_of(((mantissa >> 1 & 0xfffff000u) | 0x20000000u) + (middle ? 0x00600000u : 0x00400000u));
    const float sum_low = x - (sum_high - centre);
    const float s_low = v * ((u - s_high * sum_high) - s_high * sum_low);
    const float z = s * s;
    float r = z * z * (0x1.333334p-1f + z * (0x1.b6db6ep-2f + z * (0x1.555556p-2f + z * (0x1.17460ap-2f + z * (0x1.d864aap-3f + z * 0x1.a7e284p-3f)))));
    r += s_low * (s_high + s);
    const float square = s_high * s_high;
    const float t_high = upper(3.0f + square + r);
    const float t_low = r - ((t_high - 3.0f) - square);
    const float first = s_high * t_high;
    const float second = s_low * t_high + t_low * s;
    const float p_high = upper(first + second);
    const float p_low = second - (p_high - first);
    const float z_high = 0x1.ec8000p-1f * p_high;
    const float z_low = -0x1.ec478cp-14f * p_high + p_low * 0x1.ec709ep-1f + (middle ? 0x1.a39fb8p-20f : 0.0f);
    const float shift = middle ? 0x1.2b8000p-1f : 0.0f;
    const float n = (float)exponent;
    const float sum = upper(((z_high + z_low) + shift) + n);
    *rest = z_low - (((sum - n) - shift) - z_high);
    return sum;
}

/* Two to the power high + low, where the sum is between -150 and 128. */
static float two_to(float high, float low)
{
    const float z = low + high;
    const int32_t n = op_abs(z) > 0.5f ? (int32_t)(z + (z < 0.0f ? -0.5f : 0.5f)) : 0;
    const float left = high - (float)n;
    const float t = float_of(bits_of(low + left) & 0xffff8000u);
    const float u = t * 0x1.62e400p-1f;
    const float v = (low - (t - left)) * 0x1.62e430p-1f + t * 0x1.7f7d18p-20f;
    const float y = u + v;
    const float w = v - (y - u);
    const float square = y * y;
    const float p = y - square * (0x1.555556p-3f + square * (-0x1.6c16c2p-9f + square * (0x1.1566aap-14f + square * (-0x1.bbd41cp-20f + square * 0x1.637698p-25f))));
    const float r = (y * p) / (p - 2.0f) - (w + y * w);
    return scaled(1.0f - (r - y), n);
}

/* The size of the power, for positive a that is not 1, and y that is not 0. Infinite where it overflows. */
static float power_of(float a, float y)
{
    float rest;
    float log;
    if (op_abs(y) > 0x1.000000p27f) {
        if (a < 0x1.fffff0p-1f || a > 0x1.00000ep0f) return (a > 1.0f) == (y > 0.0f) ? 2.0f * FLT_MAX : 0.0f;
        log = log2_near_one(a, &rest);
    } else {
        log = log2_of(a, &rest);
    }
    const float y_high = upper(y);
    const float low = (y - y_high) * log + y * rest;
    const float high = y_high * log;
    const float z = low + high;
    if (z > 128.0f || (z == 128.0f && low + 0x1.715478p-25f > z - high)) return 2.0f * FLT_MAX;
    if (z < -150.0f || (z == -150.0f && low <= z - high)) return 0.0f;
    return two_to(high, low);
}

static float op_pow(float x, float y)
{
    const float a = op_abs(x);
    const float size_of_y = op_abs(y);
    if (y == 0.0f || x == 1.0f) return 1.0f;
    if (!(size_of_y <= FLT_MAX)) return a == 1.0f && y == y ? 1.0f : 0.0f;
    if (y == 1.0f) return or_zero(x);
    if (y == -1.0f) return op_recip(x);
    if (y == 2.0f) return op_sqr(x);
    if (y == 0.5f && bits_of(x) >> 31 == 0) return op_sqrt(x);
    /* What is above 2^24 is even. */
    const bool whole = size_of_y >= 0x1.000000p24f || (float)(int32_t)y == y;
    const bool odd = size_of_y < 0x1.000000p24f && whole && ((int32_t)size_of_y & 1) != 0;
    const bool negative = bits_of(x) >> 31 != 0;
    float size;
    if (a == 0.0f || !(a <= FLT_MAX) || a == 1.0f) {
        if (negative && a == 1.0f && !whole) return 0.0f;
        size = y < 0.0f ? 1.0f / a : a;
    } else {
        if (negative && !whole) return 0.0f;
        size = power_of(a, y);
    }
    return or_zero(negative && odd ? -size : size);
}
