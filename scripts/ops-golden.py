#!/usr/bin/env python3
"""Makes tests/golden/ops/*.txt: test vectors for every operation, from a source that is not the runtime.

    scripts/ops-golden.py [FOLDER]        (default: tests/golden/ops)

Needs Python 3.9 or newer and nothing else. Exactly defined operations are computed with rational numbers and rounded
once to f32 (ties to even) wherever docs/semantics.md rounds. Kernels and libm's functions get their true value from
Python's math module, with the error that docs/semantics.md allows. Random writes are recomputed from the definitions
of SplitMix64, PCG-XSH-RR 64/32 and the normal distribution. The output depends on nothing but this file
and ops_numbers.py, but for the last digit of true values that come from the platform's C library.
"""

import math
import pathlib
import random
import sys
from fractions import Fraction

from ops_numbers import (
    BINARY, CELL_THRESHOLDS, MASK, MAX, NORMAL, SLOT_THRESHOLDS, TAU, TINY, UNARY, add, ascending, bits, columns, div, f32,
    finite, finite_classic, from_bits, mean, mix64, mul, nearest, norm, pcg32, rows, sine, sqrt, std, sub, total,
)

WIDTHS = (1, 3, 4, 5, 11)
RNG = random.Random(20240805)


# Inputs.

SPECIAL = [0.0, -0.0, TINY, -3000 * TINY, NORMAL, 1.0, -1.0, f32(0.1), 3.0, -2.5, f32(1e20), -f32(1e20), MAX, -MAX]


def ordinary():
    """Roughly normal."""
    return f32(sum(RNG.random() for _ in range(12)) - 6.0)


def anything():
    """Any finite f32, every exponent alike."""
    while True:
        x = from_bits(RNG.getrandbits(32))
        if math.isfinite(x):
            return x


def between(low, high):
    return f32(low + (high - low) * RNG.random())


# Text.


def decimal(x):
    """The shortest decimal that reads back as this f32."""
    for digits in range(1, 10):
        text = f"{x:.{digits}g}"
        if abs(float(text)) < 2.0**128 - 2.0**103 and bits(f32(float(text))) == bits(x):
            return text
    raise ValueError(x)


def words(values):
    return ",".join(f"{bits(v):08x}" for v in values)


class File:
    """One file of vectors."""

    def __init__(self, name, about):
        self.name = name
        self.lines = [f"# {about}", "# Made by scripts/ops-golden.py: change that, not this. README.md explains the lines."]
        self.names = {}

    def section(self, text):
        self.lines += ["", f"# {text}"]

    def let(self, name, values):
        """Names a list of words."""
        remark = " ".join(map(decimal, values)) if len(values) <= 11 else f"{len(values)} words"
        self.lines.append(f"let @{name} {words(values)}  # {remark}")
        self.names[tuple(map(bits, values))] = name
        return values

    def value(self, values):
        values = values if isinstance(values, list) else [values]
        name = self.names.get(tuple(map(bits, values)))
        return f"@{name}" if name else words(values)

    def case(self, op, expected, **fields):
        """An exact vector."""
        expected = expected if isinstance(expected, list) else [expected]
        text, remark = self._left(op, fields)
        result = " ".join(map(decimal, expected)) if len(expected) <= 11 else f"{len(expected)} words"
        self.lines.append(f"{text} -> {words(expected)}  # {remark}{result}")

    def near(self, op, true, allowed, **fields):
        """A vector with an allowed error."""
        text, remark = self._left(op, fields)
        self.lines.append(f"{text} -> {true!r} +- {allowed:.3g}  # {remark}")

    def _left(self, op, fields):
        parts, remarks = [op], []
        for key, x in fields.items():
            if isinstance(x, (float, list)):
                parts.append(f"{key}={self.value(x)}")
                if isinstance(x, float):
                    remarks.append(f"{key} = {decimal(x)}; ")
            else:
                parts.append(f"{key}={x}")
        return " ".join(parts), "".join(remarks)

    def write(self, folder):
        (folder / f"{self.name}.txt").write_text("\n".join(self.lines) + "\n")


# Vectors.


def scalar():
    f = File("scalar", "Scalar operations that are defined exactly.")
    for op, fn in BINARY.items():
        f.section(op)
        pairs = [(x, y) for x in SPECIAL for y in SPECIAL]
        pairs += [(ordinary(), ordinary()) for _ in range(24)] + [(anything(), anything()) for _ in range(24)]
        for x, y in pairs:
            f.case(op, fn(x, y), a=x, b=y)
    for op, fn in UNARY.items():
        f.section(op)
        for x in SPECIAL + [ordinary() for _ in range(16)] + [anything() for _ in range(16)]:
            f.case(op, fn(x), a=x)
    f.section("sqrt of numbers whose root lies close to the middle of two f32")
    for _ in range(24):
        middle = Fraction(RNG.getrandbits(23) * 2 + 2**24 + 1, 2**24)
        f.case("sqrt", finite(sqrt(nearest(middle * middle))), a=nearest(middle * middle))
    f.section("cond")
    for d in (0.0, -0.0, 1.0, -2.5, MAX):
        for a in (0.0, -0.0, TINY, 1.0, -MAX, 3.0):
            for b in (0.0, 2.5, -MAX, TINY):
                f.case("cond", -b if d < a else d, d=d, a=a, b=b)
    return f


def ulp(x):
    """The spacing of f32 at a double."""
    _, exponent = math.frexp(x)
    return math.ldexp(1.0, max(exponent - 24, -149))


def settle(f, op, true, allowed, overflow=0.0, **fields):
    """A near vector, or an exact one where the true value overflows; none within 1e-5 of the limit."""
    if abs(true) < MAX * (1 - 1e-5):
        f.near(op, true, allowed(true), **fields)
    elif abs(true) > MAX * (1 + 1e-5):
        f.case(op, math.copysign(overflow, true) if overflow else 0.0, **fields)


def angle(x):
    """What sine and cosine mean by x: from 8192 on the remainder by the f32 nearest to 2 pi."""
    return x if abs(x) < 8192 else math.fmod(x, TAU)


ANGLES = [-0.0, TINY, NORMAL, f32(1e-4), 0.5, f32(0.7853981), f32(0.7853982), 1.0, f32(1.5707963), f32(1.5707964), 2.0,
          f32(3.1415927), 4.5, TAU, 10.0, 100.0, f32(8191.9), 8192.0, f32(8192.5), f32(1e5), f32(1e10), f32(1e30), MAX]
LIBM_ULPS = {"exp": 1.0, "log": 1.0, "pow": 1.0, "atan": 1.0, "tanh": 2.5}


def exp(x):
    return math.exp(x) if x < 700 else math.inf


def power(x, y):
    """x^y for finite numbers, NaN where it is not real, infinite where it overflows."""
    if x == 0 and y < 0:
        odd = y.is_integer() and abs(y) < 2**24 and int(y) % 2 == 1
        return math.copysign(math.inf, x) if odd else math.inf
    try:
        return math.pow(x, y)
    except ValueError:
        return math.nan
    except OverflowError:
        odd = y.is_integer() and abs(y) < 2**24 and int(y) % 2 == 1
        return -math.inf if x < 0 and odd else math.inf


def transcendental():
    f = File("transcendental", "Scalar operations with an allowed error: true value +- error.")
    trig = ANGLES + [-x for x in ANGLES] + [between(-10, 10) for _ in range(60)] + [between(-8192, 8192) for _ in range(40)]
    f.section("sine: 1.0e-7")
    f.case("sin", 0.0, a=0.0)
    for x in trig:
        f.near("sin", math.sin(angle(x)), 1e-7, a=x)
    f.section("cosine: 1.0e-7")
    f.case("cos", 1.0, a=0.0)
    for x in trig:
        f.near("cos", math.cos(angle(x)), 1e-7, a=x)
    f.section("tangent: what sine and cosine allow for their quotient, and one rounding")
    f.case("tan", 0.0, a=0.0)
    for x in trig:
        t, c = math.tan(angle(x)), abs(math.cos(angle(x)))
        if c > 1e-4:
            f.near("tan", t, 1e-7 * (1 + abs(t)) / (c - 1e-7) + ulp(t), a=x)
    f.section("sine, cosine and tangent bit for bit, from the definition of their kernels")
    for x in trig[: 2 * len(ANGLES) + 40]:
        f.case("sin", finite(sine(x)), a=x)
        f.case("cos", finite(sine(x, 1)), a=x)
        f.case("tan", finite(div(sine(x), sine(x, 1))), a=x)
    units = [TINY, NORMAL, f32(1e-4), 0.5, f32(0.70710677), f32(0.9999), 1 - 2.0**-24] + [between(0, 1) for _ in range(60)]
    outside = [1 + 2.0**-23, 2.0, MAX]
    half_pi, pi = f32(math.pi / 2), f32(math.pi)
    for op, fn, allowed, exact in (
        ("asin", math.asin, 2e-7, ((0.0, 0.0), (-0.0, -0.0), (1.0, half_pi), (-1.0, -half_pi))),
        ("acos", math.acos, 4e-7, ((0.0, half_pi), (-0.0, half_pi), (1.0, 0.0), (-1.0, pi))),
    ):
        f.section(f"{op}: {allowed}")
        for x, y in exact:
            f.case(op, y, a=x)
        for x in units + [-x for x in units]:
            f.near(op, fn(x), allowed, a=x)
        for x in outside + [-x for x in outside]:
            f.case(op, 0.0, a=x)
    for op, fn in (("atan", math.atan), ("tanh", math.tanh)):
        f.section(f"{op}: {LIBM_ULPS[op]} units in the last place")
        for x in (0.0, -0.0):
            f.case(op, x, a=x)
        for x in [x for x in SPECIAL if x] + [between(-3, 3) for _ in range(60)] + [anything() for _ in range(20)]:
            f.near(op, fn(x), LIBM_ULPS[op] * ulp(fn(x)), a=x)
    for x in (20.0, MAX):
        f.case("tanh", 1.0, a=x)
        f.case("tanh", -1.0, a=-x)
    f.section("exp: 1 unit in the last place; 0 where it overflows")
    for x, y in ((0.0, 1.0), (-0.0, 1.0), (TINY, 1.0), (89.0, 0.0), (MAX, 0.0), (-200.0, 0.0), (-MAX, 0.0)):
        f.case("exp", y, a=x)
    for x in [1.0, -1.0, 88.0, f32(88.7), f32(88.8), -87.0, -100.0, -103.0] + [between(-104, 89) for _ in range(60)]:
        settle(f, "exp", exp(x), ulp, a=x)
    f.section("log: 1 unit in the last place; 0 where it is undefined")
    for x in (1.0, 0.0, -0.0, -TINY, -1.0, -MAX):
        f.case("log", 0.0, a=x)
    for x in [TINY, NORMAL, f32(0.1), 1 - 2.0**-24, 1 + 2.0**-23, 2.0, 10.0, MAX] + [abs(anything()) for _ in range(60)]:
        if x > 0:
            f.near("log", math.log(x), ulp(math.log(x)), a=x)
    f.section("pow: 1 unit in the last place; 0 where it is undefined or overflows")
    for x, y, z in ((-2.0, 3.0, -8.0), (-2.0, -1.0, -0.5), (4.0, 0.5, 2.0), (-1.0, MAX, 1.0), (-1.0, 3.0, -1.0)):
        f.case("pow", z, a=x, b=y)
    pairs = [(x, y) for x in SPECIAL for y in SPECIAL] + [(abs(ordinary()), between(-20, 20)) for _ in range(60)]
    for x, y in pairs + [(ordinary(), float(RNG.randrange(-6, 7))) for _ in range(30)]:
        z = power(x, y)
        if x == 1 or y == 0 or math.isnan(z):
            f.case("pow", 0.0 if math.isnan(z) else 1.0, a=x, b=y)
        else:
            settle(f, "pow", z, ulp, a=x, b=y)
    return f


def inputs(f, w):
    """Named vectors and matrices of width w."""
    out = {}
    for kind, n in (("v", w), ("m", w * w)):
        mixed = [SPECIAL[(3 * k + 1) % len(SPECIAL)] for k in range(n)]
        huge = [math.copysign(f32(RNG.uniform(1e38, 3e38)), ordinary()) for _ in range(n)]
        named = {"p": [ordinary() for _ in range(n)], "q": [ordinary() for _ in range(n)], "mixed": mixed,
                 "huge": huge, "zero": [-0.0] * n, "level": [f32(0.1)] * n}
        out[kind] = [f.let(f"{kind}{w}.{name}", x) for name, x in named.items()]
    return out


PAIRS = ((0, 1), (2, 0), (1, 2), (3, 3), (3, 0), (4, 2), (5, 5))


def elementwise(f, prefix, lists, w):
    for op in ("add", "sub", "mul", "div", "min", "max"):
        for i, j in PAIRS:
            f.case(f"{prefix}-{op}", [BINARY[op](x, y) for x, y in zip(lists[i], lists[j])], w=w, a=lists[i], b=lists[j])
    for op in ("abs", "recip", "heaviside"):
        for x in lists[:4]:
            f.case(f"{prefix}-{op}", [UNARY[op](v) for v in x], w=w, a=x)
    for s in (2.5, -0.0, f32(1e20)):
        for x in lists[:4]:
            f.case(f"{prefix}-scale", [BINARY["mul"](s, v) for v in x], w=w, a=s, b=x)


def vector():
    f = File("vector", "Operations on vectors, and from vectors to scalars.")
    for w in WIDTHS:
        f.section(f"W = {w}")
        v = inputs(f, w)["v"]
        elementwise(f, "v", v, w)
        for s in (1.5, -0.0, -MAX):
            f.case("v-broadcast", [s] * w, w=w, a=s)
        for i, j in PAIRS:
            f.case("dot", finite(total([mul(x, y) for x, y in zip(v[i], v[j])])), w=w, a=v[i], b=v[j])
        for x in v:
            for op, fn in (("v-norm", norm), ("v-mean", mean), ("v-std", std)):
                f.case(op, fn(x), w=w, a=x)
        for k in range(w):
            f.case("v-element", v[2][k], w=w, a=v[2], index=k)
    return f


def matrix():
    f = File("matrix", "Operations on matrices, and from matrices to vectors and scalars.")
    for w in WIDTHS:
        f.section(f"W = {w}")
        named = inputs(f, w)
        v, m = named["v"], named["m"]
        elementwise(f, "m", m, w)
        flat = lambda table: [x for row in table for x in row]
        times = lambda row, x: finite(ascending([mul(p, q) for p, q in zip(row, x)]))
        for i, j in PAIRS:
            f.case("mat-vec", [times(row, v[j]) for row in rows(m[i], w)], w=w, a=m[i], b=v[j])
            f.case("outer", [BINARY["mul"](x, y) for x in v[i] for y in v[j]], w=w, a=v[i], b=v[j])
            product = [times(row, column) for row in rows(m[i], w) for column in columns(m[j], w)]
            f.case("mat-mul", product, w=w, a=m[i], b=m[j])
        for x in m:
            f.case("row-norm", [norm(row) for row in rows(x, w)], w=w, a=x)
            f.case("column-norm", [norm(column) for column in columns(x, w)], w=w, a=x)
            f.case("row-mean", [mean(row) for row in rows(x, w)], w=w, a=x)
            f.case("row-std", [std(row) for row in rows(x, w)], w=w, a=x)
            for op, fn in (("m-norm", norm), ("m-mean", mean), ("m-std", std)):
                f.case(op, fn(x), w=w, a=x)
        for x in (m[0], m[2]):
            f.case("transpose", flat(columns(x, w)), w=w, a=x)
        for x in (v[0], v[2]):
            f.case("broadcast-rows", x * w, w=w, a=x)
            f.case("broadcast-columns", [value for value in x for _ in range(w)], w=w, a=x)
        for k in sorted({0, w - 1, w * w // 2, w * w - 1}):
            f.case("m-element", m[2][k], w=w, a=m[2], index=k)
    return f


def classic():
    f = File("classic", "The classic set: d is the destination's old value.")
    fns = {
        "classic-add": lambda d, a: finite_classic(add(d, a)),
        "classic-sub": lambda d, a: finite_classic(sub(d, a)),
        "classic-neg": lambda d, a: -d if d < a else d,
    }
    pairs = [(x, y) for x in SPECIAL[::2] + [MAX] for y in SPECIAL[1::2] + [0.0]] + [(ordinary(), ordinary()) for _ in range(24)]
    for op, fn in fns.items():
        f.section(op)
        for d, a in pairs:
            f.case(op, fn(d, a), d=d, a=a)
    for op, factor in (("classic-mult", 2.0), ("classic-div", 0.5)):
        f.section(op)
        for d in SPECIAL + [3 * TINY] + [anything() for _ in range(24)]:
            f.case(op, finite_classic(mul(d, factor)), d=d)
    f.section("classic-cos: as cos")
    f.case("classic-cos", 1.0, a=0.0)
    for x in ANGLES + [between(-100, 100) for _ in range(30)]:
        f.near("classic-cos", math.cos(angle(x)), 1e-7, a=x)
    f.section("classic-exp: as exp, but the largest number where it overflows")
    for x, y in ((0.0, 1.0), (89.0, MAX), (MAX, MAX), (-200.0, 0.0), (-MAX, 0.0)):
        f.case("classic-exp", y, a=x)
    for x in [1.0, 88.0, -100.0] + [between(-104, 100) for _ in range(30)]:
        settle(f, "classic-exp", exp(x), ulp, MAX, a=x)
    f.section("classic-log: unchanged unless the operand is above zero")
    for x in (0.0, -0.0, -TINY, -1.0, -MAX):
        f.case("classic-log", -2.5, d=-2.5, a=x)
    f.case("classic-log", 0.0, d=-2.5, a=1.0)
    for x in [TINY, 2.0, MAX] + [abs(anything()) for _ in range(30)]:
        f.near("classic-log", math.log(x), ulp(math.log(x)), d=-2.5, a=x)
    return f


def copies():
    f = File("copies", "Moves and latches: d is the destination's old value.")
    f.section("move")
    for x in SPECIAL + [anything() for _ in range(8)]:
        f.case("move", x, a=x)
    gates = [0.0, -0.0, TINY, -TINY, 1.0, -1.0, MAX, -MAX, NORMAL]
    f.section("latch")
    for a in gates:
        for d, b in ((2.5, -0.0), (-0.0, 2.5), (a, -1.5), (MAX, TINY), (3.0, a)):
            f.case("latch", b if a > 0 else d, d=d, a=a, b=b)
    for w in WIDTHS:
        f.section(f"W = {w}")
        for prefix, lists in inputs(f, w).items():
            for x in lists[:4]:
                f.case(f"{prefix}-move", x, w=w, a=x)
            for k, a in enumerate(gates):
                d, b = lists[k % len(lists)], lists[(k + 1 + k // 6) % len(lists)]
                f.case(f"{prefix}-latch", b if a > 0 else d, w=w, d=d, a=a, b=b)
            f.case(f"{prefix}-latch", lists[0], w=w, d=lists[0], a=1.0, b=lists[0])
    return f


# Random writes.


def memory():
    f = File("memory", "Constants and team memory; writes: the slots that successive writes draw.")
    for w in WIDTHS:
        f.section(f"W = {w}")
        for op, n in (("reload-s", 1), ("reload-v", w), ("reload-m", w * w)):
            x = [anything() for _ in range(n)]
            f.case(op, x, w=w, constant=x)
        for kept in ((0xFF, 0xFF, 0xFF), (0x81, 0x24, 0x42), (0x10, 0x00, 0x08)):
            sizes = (1, w, w * w)
            slots = [(section, slot) for section in range(3) for slot in range(8) if kept[section] >> slot & 1]
            held = {key: [ordinary() for _ in range(sizes[key[0]])] for key in slots}
            if w == 11 and kept[0] == 0xFF:
                continue  # long, and nothing that the others lack
            mask = ",".join(f"{k:02x}" for k in kept)
            image = f.let(f"memory{w}.{kept[0]:02x}", [x for key in slots for x in held[key]])
            common = {"w": w, "kept": mask, "memory": image}
            for section, slot in slots:
                index = RNG.randrange(sizes[section])
                value = held[section, slot]
                if section == 0:
                    f.case("read-s", value, **common, slot=slot)
                else:
                    name = ("v", "m")[section - 1]
                    f.case(f"read-{name}", value[index], **common, slot=slot, index=index)
                    if slot % 3 == 2 or kept[0] != 0xFF:
                        f.case(f"read-whole-{name}", value, **common, slot=slot)
    for section, op in enumerate(("write-s", "write-v", "write-m")):
        f.section(op)
        for seed, key, kept, w in ((0, 0, "ff,ff,ff", 1), (42, 7, "ff,ff,ff", 3), (MASK, 2**32 - 1, "3c,99,08", 4)):
            stream = pcg32(mix64(seed, key, section), mix64(key, section))
            drawn = [sum(t <= draw for t in SLOT_THRESHOLDS) for draw in (next(stream) for _ in range(400))]
            text = ",".join(map(str, drawn))
            f.lines.append(f"{op} w={w} seed={seed:016x} key={key:08x} kept={kept} -> slots {text}")
    return f


def indexed():
    f = File("indexed", "Indexed memory; writes: for each of several writes, the cells that it reaches.")
    f.section("mem-read")
    for kept in ([0, 1, 7, 8, 399, 400, 792, 799], [5], [3, 500, 501]):
        held = f.let(f"cells{len(kept)}", [ordinary() for _ in kept])
        for cell, value in zip(kept, held):
            f.case("mem-read", value, kept=",".join(map(str, kept)), memory=held, cell=cell)
    f.section("mem-write: writes are separated by semicolons")
    for seed in (0, 42, MASK):
        stream, writes = mix64(seed, 0, 3), []
        for write in range(24):
            reached = []
            for cell in range(800):
                row = cell // 8
                distance = 49 - row if row < 50 else row - 50
                if mix64(stream, write, cell) >> 32 < CELL_THRESHOLDS[distance]:
                    reached.append(str(cell))
            writes.append(",".join(reached))
        f.lines.append(f"mem-write seed={seed:016x} -> cells {';'.join(writes)}")
    return f


def main():
    here = pathlib.Path(__file__).resolve().parent.parent
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here / "tests/golden/ops"
    folder.mkdir(parents=True, exist_ok=True)
    for make in (scalar, transcendental, vector, matrix, classic, memory, indexed, copies):
        make().write(folder)


if __name__ == "__main__":
    main()
