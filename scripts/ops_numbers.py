"""Exact f32 arithmetic and random streams for ops-golden.py: rational numbers, rounded once to f32, ties to even."""

import math
import struct
from decimal import Decimal, getcontext
from fractions import Fraction

MAX = float.fromhex("0x1.fffffep127")
TINY = 2.0**-149
NORMAL = 2.0**-126
TAU = float.fromhex("0x1.921fb6p2")  # the f32 nearest to 2 pi


# A value is a Python float that is exactly an f32.


def nearest(q, negative_zero=False):
    """The f32 nearest to a rational, ties to even; infinite where it overflows."""
    if q == 0:
        return -0.0 if negative_zero else 0.0
    sign, q = (-1.0, -q) if q < 0 else (1.0, q)
    exponent = q.numerator.bit_length() - q.denominator.bit_length()
    if q < Fraction(2) ** exponent:
        exponent -= 1
    exponent = max(exponent, -126) - 23
    units = round(q / Fraction(2) ** exponent)  # a Fraction rounds ties to even
    if units == 0:
        return sign * 0.0
    if units * Fraction(2) ** exponent >= 2**128:
        return sign * math.inf
    return sign * math.ldexp(units, exponent)


def f32(x):
    """The f32 nearest to a finite double."""
    return nearest(Fraction(x), math.copysign(1.0, x) < 0)


def bits(x):
    return struct.unpack("<I", struct.pack("<f", x))[0]


def from_bits(word):
    return struct.unpack("<f", struct.pack("<I", word))[0]


def negative(x):
    return math.copysign(1.0, x) < 0


def add(x, y):
    if not (math.isfinite(x) and math.isfinite(y)):
        return x + y
    return nearest(Fraction(x) + Fraction(y), negative(x) and negative(y))


def sub(x, y):
    return add(x, -y)


def mul(x, y):
    if not (math.isfinite(x) and math.isfinite(y)):
        return x * y
    return nearest(Fraction(x) * Fraction(y), negative(x) != negative(y))


def div(x, y):
    if y == 0:
        return math.nan if x == 0 or math.isnan(x) else math.copysign(math.inf, x) * math.copysign(1.0, y)
    if not (math.isfinite(x) and math.isfinite(y)):
        return x / y
    return nearest(Fraction(x) / Fraction(y), negative(x) != negative(y))


def sqrt(x):
    """Correctly rounded, by the integer square root of a scaled square with a sticky bit."""
    if x == 0 or math.isnan(x) or x == math.inf:
        return x
    if x < 0:
        return math.nan
    square = Fraction(x) * Fraction(4) ** 150  # a whole number, for every f32
    root = math.isqrt(square.numerator * 4**40)
    sticky = 0 if root * root == square.numerator * 4**40 else 1
    return nearest(Fraction(2 * root + sticky, 2 ** (1 + 150 + 40)))


def finite(x):
    """The number rule of the standard set."""
    return x if math.isfinite(x) else 0.0


def finite_classic(x):
    """The number rule of the classic set."""
    if math.isnan(x):
        return 0.0
    return math.copysign(MAX, x) if math.isinf(x) else x


def total(values):
    """Four partial sums from +0, element k into sum k mod 4, joined (p0 + p1) + (p2 + p3)."""
    p = [0.0] * 4
    for k, x in enumerate(values):
        p[k % 4] = add(p[k % 4], x)
    return add(add(p[0], p[1]), add(p[2], p[3]))


def ascending(values):
    result = 0.0
    for x in values:
        result = add(result, x)
    return result


def norm(x):
    return finite(sqrt(total([mul(v, v) for v in x])))


def mean(x):
    return finite(div(total(x), float(len(x))))


def std(x):
    m = mean(x)
    squares = [mul(sub(v, m), sub(v, m)) for v in x]
    return finite(sqrt(div(total(squares), float(len(x)))))


def rows(m, w):
    return [m[r * w : r * w + w] for r in range(w)]


def columns(m, w):
    return [m[c::w] for c in range(w)]


BINARY = {
    "add": lambda x, y: finite(add(x, y)),
    "sub": lambda x, y: finite(sub(x, y)),
    "mul": lambda x, y: finite(mul(x, y)),
    "div": lambda x, y: finite(div(x, y)),
    "min": lambda x, y: x if x < y else y,
    "max": lambda x, y: x if x > y else y,
}
UNARY = {
    "abs": abs,
    "recip": lambda x: finite(div(1.0, x)),
    "heaviside": lambda x: 1.0 if x >= 0 else 0.0,
    "sqr": lambda x: finite(mul(x, x)),
    "cube": lambda x: finite(mul(mul(x, x), x)),
    "sqrt": lambda x: finite(sqrt(x)),
}

# The kernels of sine and cosine, as docs/semantics.md defines them.

S2, S1, S0 = map(from_bits, (0xB94CA1F9, 0x3C08839E, 0x3E2AAAA3))
C2, C1, C0 = map(from_bits, (0x37CCF5CE, 0x3AB6061A, 0x3D2AAAA5))
TWO_OVER_PI, HALF_PI_PARTS = from_bits(0x3F22F983), tuple(map(from_bits, (0x3FC90000, 0x39FDA000, 0x33A22169)))


def sine(x, quarter=0):
    """sin(x + quarter right angles)."""
    if not -8192 < x < 8192:
        x = math.fmod(x, TAU)  # exact
    q = mul(x, TWO_OVER_PI)
    quadrant = int(sub(q, 0.5) if q < 0 else add(q, 0.5))
    r = x
    for part in HALF_PI_PARTS:
        r = sub(r, mul(float(quadrant), part))
    z = mul(r, r)
    if (quadrant + quarter) % 2 == 0:
        s = sub(mul(add(mul(S2, z), S1), z), S0)
        result = add(mul(mul(s, z), r), r)
    else:
        c = add(mul(sub(mul(C2, z), C1), z), C0)
        result = add(sub(mul(mul(c, z), z), mul(0.5, z)), 1.0)
    return -result if (quadrant + quarter) & 2 else result


# Random writes.

MASK = 2**64 - 1


def mix64(*arguments):
    h = 0
    for x in arguments:
        z = ((h + 0x9E3779B97F4A7C15) & MASK) ^ x
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        h = z ^ (z >> 31)
    return h


def pcg32(state, stream):
    """PCG-XSH-RR 64/32, seeded as in its reference implementation."""
    increment = (stream << 1 | 1) & MASK
    state = ((state + increment) * 6364136223846793005 + increment) & MASK
    while True:
        rotation, word = state >> 59, (((state >> 18) ^ state) >> 27) & 0xFFFFFFFF
        yield (word >> rotation | word << (32 - rotation) & 0xFFFFFFFF) if rotation else word
        state = (state * 6364136223846793005 + increment) & MASK


getcontext().prec = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494")


def normal_cdf(z):
    """The normal distribution function to some 40 digits, by the Taylor series of erf(z / sqrt 2)."""
    x, term, result = z / Decimal(2).sqrt(), z / Decimal(2).sqrt(), Decimal(0)
    for n in range(400):
        result += term / (2 * n + 1)
        term *= -x * x / (n + 1)
    return (1 + 2 * result / PI.sqrt()) / 2


SLOT_THRESHOLDS = [int(normal_cdf(Decimal(3 * (j + 1 - 4)) / 4) * 2**32) for j in range(7)]
CELL_THRESHOLDS = [int(Decimal("0.25") / (PI / 2 * (i * i + Decimal("0.25"))) * 2**32) for i in range(50)]
