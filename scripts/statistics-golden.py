#!/usr/bin/env python3
"""Makes tests/golden/statistics.json: what SciPy says of small samples, for tests/tests/statistics.rs.

    scripts/statistics-golden.py [FILE]        (default: tests/golden/statistics.json)

Needs SciPy (made with 1.17.1): python3 -m venv VENV && VENV/bin/pip install scipy==1.17.1
"""

import json
import pathlib
import sys

import numpy
from scipy import stats

RNG = numpy.random.default_rng(20260122)
RESAMPLES = 1_000_000


def sample(n, shift=0.0, digits=6):
    return [round(float(x), digits) for x in RNG.normal(shift, 1.0, n)]


def pair(a, b, method):
    test = stats.mannwhitneyu(a, b, method=method, use_continuity=True, alternative="two-sided")
    return {"a": a, "b": b, "method": method, "u": float(test.statistic), "p": float(test.pvalue)}


def main():
    exact = [(1, 1, 0), (2, 3, 1), (5, 5, 0), (5, 5, 9), (5, 4, 1), (4, 5, 1), (8, 8, 1), (10, 10, 0), (10, 10, 1), (3, 20, 2), (25, 25, 1)]
    large = [(26, 5, 1), (100, 100, 0), (100, 100, 0.3), (100, 100, 9)]
    tied = [(5, 5, 0, 0), (10, 10, 1, 0), (10, 8, 2, 0), (100, 100, 0, 1), (100, 60, 0.5, 0)]
    tests = [pair(sample(n), sample(m, shift), "exact") for n, m, shift in exact]
    tests += [pair(sample(n), sample(m, shift), "asymptotic") for n, m, shift in large]
    tests += [pair(sample(n, 0, digits), sample(m, shift, digits), "asymptotic") for n, m, shift, digits in tied]
    tests += [pair([500.0] * 5, [500.0, 500.0, 500.0, 493.2, 121.0], "asymptotic")]

    holm = []
    for p in ([0.01, 0.04, 0.03, 0.005], [0.5, 0.6, 0.02], [0.008, 0.008, 0.008, 0.0079, 0.3, 1.0], [0.2], [0.05, 0.05]):
        holm.append({"p": p, "corrected": holm_correction(p)})

    means = []
    for values in (sample(5), sample(10, 3), [9.0, 120.5, 500.0, 500.0, 480.25], sample(30, -2)):
        interval = stats.bootstrap(
            (values,), numpy.mean, n_resamples=RESAMPLES, batch=10_000, method="percentile",
            rng=numpy.random.default_rng(7)).confidence_interval
        means.append({"values": values, "low": float(interval.low), "high": float(interval.high)})

    file = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "tests/golden/statistics.json")
    file.write_text(json.dumps({"mann_whitney": tests, "holm": holm, "bootstrap": means}, separators=(",", ":")).replace("},{", "},\n{") + "\n")


def holm_correction(p):
    """SciPy has no Holm: each corrected value is the least level at which Holm's procedure, step by step, rejects."""
    def rejected(level):
        left = sorted(range(len(p)), key=lambda i: p[i])
        out = set()
        while left and p[left[0]] * len(left) <= level:
            out.add(left.pop(0))
        return out
    levels = sorted({min(1.0, x * k) for x in p for k in range(1, len(p) + 1)} | {1.0})
    return [min((level for level in levels if i in rejected(level)), default=1.0) for i in range(len(p))]


if __name__ == "__main__":
    main()
