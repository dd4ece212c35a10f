/* The exact remainder over the float nearest to 2 pi, with the sign of x, which is finite. */
static inline float remainder_of_turns(float x)
{
    const uint32_t exponent = bits_of(x) >> 23 & 0xffu;
    const uint32_t turn = 0x00c90fdbu;
    if (exponent < 129u) return x;
    uint32_t left = (bits_of(x) & 0x007fffffu) | 0x00800000u;
    for (uint32_t k = 129u; k < exponent; k++) {
        if (left >= turn) left -= turn;
        left <<= 1;
    }
    if (left >= turn) left -= turn;
    return float_of(bits_of((float)left * 0x1.000000p-21f) | (bits_of(x) & 0x80000000u));
}

/* The sine of x and so many right angles: x is reduced by pi/2 in three parts, then a polynomial follows. */
static inline float sine_from(float x, uint32_t quadrant)
{
    float r = x > -8192.0f && x < 8192.0f ? x : remainder_of_turns(x);
    if (!(r > -0.78f && r < 0.78f)) {
        const float q = r * 0x1.45f306p-1f;
        const int32_t nearest = (int32_t)(q + (bits_of(q) >> 31 ? -0.5f : 0.5f));
        const float k = (float)nearest;
        r = ((r - k * 1.5703125f) - k * 4.837513e-4f) - k * 7.54979e-8f;
        quadrant += (uint32_t)nearest;
    }
    const float z = r * r;
    const float sine = ((-1.9515296e-4f * z + 8.332161e-3f) * z - 1.6666655e-1f) * z * r + r;
    const float cosine = ((2.4433157e-5f * z - 1.3887316e-3f) * z + 4.1666646e-2f) * z * z - 0.5f * z + 1.0f;
    return float_of(bits_of(quadrant & 1u ? cosine : sine) ^ (quadrant & 2u) << 30);
}

static inline float op_sin(float x) { return or_zero(sine_from(x, 0)); }

static inline float op_cos(float x) { return or_zero(sine_from(x, 1)); }

static inline float op_tan(float x) { return or_zero(op_sin(x) / op_cos(x)); }

static inline float op_classic_cos(float x) { return op_cos(x); }
