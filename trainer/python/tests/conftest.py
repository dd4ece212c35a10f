"""Where the tests find champions, and small settings that train in seconds."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import tpg

ROOT = Path(__file__).resolve().parents[3]
CHAMPIONS = sorted((ROOT / "docs" / "champions").glob("*.tpg"))
SMALL = {"evolution.population": 30, "evolution.children": 30, "evaluation.episodes": 2}


@pytest.fixture(params=CHAMPIONS, ids=lambda path: path.stem)
def champion(request) -> tpg.Policy:
    return tpg.Policy(request.param)


def champion_of(name: str) -> tpg.Policy:
    return tpg.Policy(ROOT / "docs" / "champions" / f"{name}.tpg")


def observations(policy: tpg.Policy, count: int, seed: int = 0) -> np.ndarray:
    """Observations as policies meet them, some of them blank."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(count, policy.observation_len)).astype(np.float32)
    rows[rng.random(count) < 0.3] = 0
    return rows


def act_all(policy: tpg.Policy, rows: np.ndarray, seed: int = 1) -> np.ndarray:
    policy.reset(seed)
    return np.array([policy.act(row) for row in rows])


def interrupt(script: str, folder: Path) -> None:
    """Runs a script in a folder until it prints a line, interrupts it, and expects KeyboardInterrupt within a second."""

    def listen():
        # A shell lets what it starts in the background ignore SIGINT; Python then installs no handler.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", script], cwd=folder, preexec_fn=listen, **pipes) as child:
        child.stdout.readline()
        time.sleep(0.3)
        child.send_signal(signal.SIGINT)
        sent = time.monotonic()
        _, error = child.communicate(timeout=30)
    assert time.monotonic() - sent < 1
    assert b"KeyboardInterrupt" in error
