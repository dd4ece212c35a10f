/* SplitMix64, and floats put together from its bits: the generator of common/src/trial.rs, so that its runs compare. */
#include "sensors.h"

/* By way of a union, since without a C library there may be no memcpy. */
static float from_bits(uint32_t bits)
{
    const union { uint32_t bits; float value; } both = {bits};
    return both.value;
}

uint64_t sensors_bits(sensors *self)
{
    self->state += 0x9e3779b97f4a7c15u;
    uint64_t z = (self->state ^ (self->state >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* A float with this exponent field, any sign and any mantissa. */
static float with_exponent(sensors *self, uint32_t exponent)
{
    return from_bits(((uint32_t)sensors_bits(self) & 0x807fffffu) | exponent << 23);
}

/* As sensors give it: magnitude from 2^-7 to 8. */
static float ordinary(sensors *self)
{
    const uint32_t exponent = 120 + (uint32_t)(sensors_bits(self) % 10);
    return with_exponent(self, exponent);
}

static float any(sensors *self)
{
    switch (sensors_bits(self) % 12) {
    case 0: return 0.0f;
    case 1: return -0.0f;
    case 2: return with_exponent(self, 0);
    case 3: {
        const uint32_t exponent = 250 + (uint32_t)(sensors_bits(self) % 5);
        return with_exponent(self, exponent);
    }
    case 4: return from_bits(0x7fc00001u | ((uint32_t)sensors_bits(self) & 0x803fffffu));
    case 5: return from_bits(0x7f800000u);
    case 6: return from_bits(0xff800000u);
    case 7: {
        const uint32_t exponent = 1 + (uint32_t)(sensors_bits(self) % 254);
        return with_exponent(self, exponent);
    }
    default: return ordinary(self);
    }
}

void sensors_observe(sensors *self, float *observation, size_t length)
{
    const uint64_t kind = sensors_bits(self) % 32;
    for (size_t k = 0; k < length; k++)
        observation[k] = kind < 16 ? ordinary(self) : kind < 24 ? 0.0f : any(self);
}
