"""What calls cost, and how fast training steps environments. Times are CPU time; run it on a machine that is idle."""

import time
from pathlib import Path

import gymnasium
import numpy as np

import tpg

CHAMPIONS = Path(__file__).parents[3] / "docs" / "champions"
ROWS = 256


def nanoseconds(call, count):
    """The least of five measurements."""

    def once():
        started = time.process_time()
        for _ in range(count):
            call()
        return (time.process_time() - started) / count * 1e9

    return min(once() for _ in range(5))


for path in sorted(CHAMPIONS.glob("*.tpg")):
    policy = tpg.Policy(path)
    rows = np.random.default_rng(0).normal(size=(ROWS, policy.observation_len)).astype(np.float32)
    policy.reset_batch(range(ROWS))
    act = nanoseconds(lambda: policy.act(rows[0]), 20_000)
    batch = nanoseconds(lambda: policy.act_batch(rows), 200) / ROWS
    print(f"{path.stem:32} act {act:5.0f} ns, a row of act_batch {batch:5.0f} ns, state {policy.bounds['state_bytes']} bytes")


def make_vector(count):
    return gymnasium.make_vec("CartPole-v1", count, vectorization_mode="vector_entry_point")


def bare(count):
    env = make_vector(count)
    env.reset(seed=0)
    actions, steps, started = np.zeros(count, np.int64), 0, time.process_time()
    while time.process_time() - started < 3:
        env.step(actions)
        actions ^= 1
        steps += count
    return steps / (time.process_time() - started)


settings = {"evolution.population": 300, "evolution.children": 300}
for count in (64, 512):
    started = time.process_time()
    result = tpg.train(lambda: make_vector(count), "sr-sm", seed=1, generations=10, settings=settings, progress=False)
    speed = result.steps / (time.process_time() - started)
    plain = bare(count)
    print(f"CartPole, {count} environments: {speed:,.0f} steps per CPU-second in training, {plain:,.0f} bare")
