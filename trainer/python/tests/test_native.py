"""Scores on built-in tasks, without Python in the loop."""

import textwrap
import threading
import time

import numpy as np
import pytest
from conftest import ROOT, SMALL, champion_of, interrupt

import tpg

#: As `tpg eval docs/champions/pendulum.tpg --episodes 3 --seed 5 --json` prints them.
RETURNS = [-127.40964246835537, -127.49958826729359, -127.24612447514005]
#: The same with `--disturb noise:0.01 --disturb action:delay:1`.
DISTURBED = [-127.51895522237882, -128.3315104432401, -129.83128584597412]


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_returns_are_those_of_the_command(threads):
    policy = champion_of("pendulum")
    scores = tpg.evaluate_native(policy, episodes=3, seed=5, threads=threads)
    assert scores.returns.tolist() == RETURNS
    assert scores.lengths.tolist() == [200, 200, 200] and scores.instructions_mean == 61
    assert scores.mean == pytest.approx(np.mean(RETURNS)) and scores.interval[0] <= scores.mean <= scores.interval[1]
    disturb = ["noise:0.01", "action:delay:1"]
    assert tpg.evaluate_native(policy, "pendulum", episodes=3, seed=5, disturb=disturb).returns.tolist() == DISTURBED


def test_a_policy_of_a_run_scores_on_the_task_of_another_name():
    policy = tpg.train("CartPole-v1", "sr-sm", seed=1, generations=2, settings=SMALL, progress=False).policy
    scores = tpg.evaluate_native(policy, "cartpole", episodes=5)
    assert (scores.returns == scores.lengths).all()
    # It was evolved for an environment that is not built in.
    with pytest.raises(ValueError, match='evolved for the task "CartPole-v1", which is not built in'):
        tpg.evaluate_native(policy)


def test_bad_arguments_say_what_is_wrong():
    policy = champion_of("pendulum")
    for how, message in [
        ({"task": "pendulumm"}, 'did you mean "pendulum"'),
        ({"task": "cartpole"}, "does not fit task cartpole-v1"),
        ({"task": "hopper"}, "needs MuJoCo"),
        ({"observability": "blackout:2"}, "observability"),
        ({"disturb": "noise"}, "noise"),
        ({"disturb": "nan:9:1/2"}, "9"),
        ({"episodes": 0}, "episodes must be at least 1"),
        ({"threads": 0}, "threads must be at least 1"),
    ]:
        with pytest.raises(ValueError, match=message):
            tpg.evaluate_native(policy, **how)
    assert "cartpole-v1" in tpg.task_names()


def test_other_threads_of_python_run_meanwhile():
    policy, scores = champion_of("pendulum"), []
    thread = threading.Thread(target=lambda: scores.append(tpg.evaluate_native(policy, episodes=2000)))
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
        time.sleep(0)
    assert len(scores) == 1
    # With the lock held there would be a turn before and one after.
    assert turns > 100


def test_an_interrupt_ends_it_within_a_second(tmp_path):
    script = textwrap.dedent(f"""
        import tpg
        policy = tpg.Policy({str(ROOT / "docs" / "champions" / "pendulum.tpg")!r})
        print("begun", flush=True)
        tpg.evaluate_native(policy, episodes=2_000_000)
    """)
    interrupt(script, tmp_path)
