"""Every example runs, with small numbers, and says what it should."""

import re
import subprocess
import sys

import pytest
from conftest import ROOT

EXAMPLES = ROOT / "trainer" / "python" / "examples"


@pytest.mark.parametrize(
    ("script", "arguments", "pattern"),
    [
        ("cartpole.py", ["3"], r"3 generations, [0-9]+ steps: mean return [0-9.]+\n.*\ncartpole.h cartpole.c"),
        ("hopper.py", [], r"blackout:2/3\): mean return [0-9]{3,4} "),
        ("minigrid_empty.py", ["1"], r"147 inputs, Discrete\(7\)\nmean return"),
        ("tune.py", ["3", "8"], r"best mean return [0-9.]+ with"),
        ("tensorboard.py", ["logs", "2"], ""),
        ("viewer.py", ["50"], "50 steps"),
    ],
)
def test_examples_run(tmp_path, script, arguments, pattern):
    command = [sys.executable, EXAMPLES / script, *arguments]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    assert re.search(pattern, ran.stdout), ran.stdout
    if script == "tensorboard.py":
        assert list((tmp_path / "logs").glob("events.out.*"))
