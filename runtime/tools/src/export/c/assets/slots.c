/* The next state of a random stream: PCG-XSH-RR 64/32. */
static inline uint64_t next_state(uint64_t state, uint64_t increment)
{
    return state * UINT64_C(6364136223846793005) + increment;
}

static inline TPG_STREAM slot_stream(uint64_t agent_seed, uint64_t key, uint64_t section)
{
    const uint64_t state[3] = { agent_seed, key, section }, stream[2] = { key, section };
    TPG_STREAM s;
    s.increment = (mix64(stream, 2) << 1) | 1;
    s.state = next_state(mix64(state, 3) + s.increment, s.increment);
    return s;
}

/* The slot of a write: how many of these thresholds lie at or below one 32-bit draw. */
static inline int draw_slot(TPG_STREAM *s)
{
    static const uint32_t thresholds[7] = { TPG_SLOT_THRESHOLDS };
    const uint32_t x = (uint32_t)(((s->state >> 18) ^ s->state) >> 27), rotation = (uint32_t)(s->state >> 59);
    const uint32_t draw = (x >> rotation) | (x << ((32 - rotation) & 31));
    s->state = next_state(s->state, s->increment);
    int slot = 0;
    for (int k = 0; k < 7; k++) slot += thresholds[k] <= draw;
    return slot;
}
