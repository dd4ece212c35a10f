"""Compares decisions of every committed champion in Python with those that `tpg eval --trace` recorded.

python3 scripts/python_bits.py PATH-OF-tpg [DECISIONS], in an environment with the package `tpg`.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import tpg

ROOT = Path(__file__).resolve().parents[1]


def words(texts):
    return np.array([int(text, 16) for text in texts], np.uint32)


def compare(champion, trace, wanted):
    """Decisions that were compared, and those that differ."""
    policy, decisions, differ = tpg.Policy(champion), 0, 0
    for line in trace.open():
        (kind, value), = json.loads(line).items()
        if kind == "reset":
            seed = value["seed"]
            policy.reset(int(seed, 16) if isinstance(seed, str) else seed, agent=value["agent"])
        elif kind == "decision":
            action = policy.act(words(value["observation"]).view(np.float32))
            got = [str(action)] if isinstance(action, int) else [f"{word:08x}" for word in action.view(np.uint32)]
            expected = value["action"]
            if not isinstance(expected, list):
                expected = [expected]
            decisions, differ = decisions + 1, differ + (got != [str(word) for word in expected])
            if decisions == wanted:
                break
    return decisions, differ


def main():
    command, wanted = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    bad = False
    for champion in sorted((ROOT / "docs" / "champions").glob("*.tpg")):
        with tempfile.TemporaryDirectory() as folder:
            trace, episodes = Path(folder) / "trace", 60
            decisions = 0
            while decisions < wanted:
                run = [command, "eval", champion, "--episodes", str(episodes), "--trace", trace]
                subprocess.run(run, check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
                decisions, differ = compare(champion, trace, wanted)
                trace.unlink()
                episodes *= 3
        print(f"{champion.stem:32} {decisions} decisions, {differ} differ")
        bad |= differ > 0
    sys.exit(bad)


main()
