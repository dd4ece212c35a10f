static inline void op_column_norm(float *d, const float *x)
{
    for (int c = 0; c < W; c++) {
        float p[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
        for (int r = 0; r < W; r++) p[r % 4] += x[r * W + c] * x[r * W + c];
        d[c] = op_sqrt(join(p));
    }
}

/* The destination of these may be an operand, so the result is made beside it. */
static inline void op_mat_vec(float *d, const float *x, const float *y)
{
    float out[W];
    for (int r = 0; r < W; r++) {
        float sum = 0.0f;
        for (int k = 0; k < W; k++) sum += x[r * W + k] * y[k];
        out[r] = or_zero(sum);
    }
    copy(d, out, W);
}

static inline void op_mat_mul(float *d, const float *x, const float *y)
{
    float out[W * W];
    for (int r = 0; r < W; r++) {
        for (int c = 0; c < W; c++) {
            float sum = 0.0f;
            for (int k = 0; k < W; k++) sum += x[r * W + k] * y[k * W + c];
            out[r * W + c] = or_zero(sum);
        }
    }
    copy(d, out, W * W);
}

static inline void op_transpose(float *d, const float *x)
{
    float out[W * W];
    for (int r = 0; r < W; r++) {
        for (int c = 0; c < W; c++) out[r * W + c] = x[c * W + r];
    }
    copy(d, out, W * W);
}
