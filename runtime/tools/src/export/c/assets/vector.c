static inline void copy(float *d, const float *x, int n)
{
    for (int k = 0; k < n; k++) d[k] = x[k];
}

/* Element k of a sum goes into partial sum k mod 4; they are joined as (p0 + p1) + (p2 + p3). */
static inline float join(const float p[4]) { return (p[0] + p[1]) + (p[2] + p[3]); }

static inline float op_dot(const float *x, const float *y)
{
    float p[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
    for (int k = 0; k < W; k++) p[k % 4] += x[k] * y[k];
    return or_zero(join(p));
}

static inline float op_mean(const float *x, int n)
{
    float p[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
    for (int k = 0; k < n; k++) p[k % 4] += x[k];
    return or_zero(join(p) / (float)n);
}

static inline float op_norm(const float *x, int n)
{
    float p[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
    for (int k = 0; k < n; k++) p[k % 4] += x[k] * x[k];
    return op_sqrt(join(p));
}

static inline float op_std(const float *x, int n)
{
    float p[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
    const float m = op_mean(x, n);
    for (int k = 0; k < n; k++) p[k % 4] += (x[k] - m) * (x[k] - m);
    return op_sqrt(join(p) / (float)n);
}
