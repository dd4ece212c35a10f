/* SplitMix64's finaliser, chained over the words. */
static inline uint64_t mix64(const uint64_t *words, int n)
{
    uint64_t h = 0;
    for (int k = 0; k < n; k++) {
        uint64_t z = (h + UINT64_C(0x9e3779b97f4a7c15)) ^ words[k];
        z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
        h = z ^ (z >> 31);
    }
    return h;
}
