"""Measures gymnasium and envpool in turn with this project's tasks, and prints one table. Run by scripts/bench-peers."""

import statistics
import subprocess
import sys
import time

import envpool
import gymnasium
import mujoco
import numpy as np

gymnasium.logger.min_level = gymnasium.logger.ERROR
mujoco.set_mju_user_warning(lambda message: None)

# Gymnasium's name and control steps of a round, for each task.
TASKS = {
    "inverted-double-pendulum": ("InvertedDoublePendulum-v4", 10_000),
    "hopper": ("Hopper-v4", 8_000),
    "half-cheetah": ("HalfCheetah-v4", 10_000),
    "cartpole": ("CartPole-v1", 50_000),
    "acrobot": ("Acrobot-v1", 20_000),
    "pendulum": ("Pendulum-v1", 50_000),
}
# Environments that one call of envpool steps, so that Python's part in it is small.
BATCH = 64


def actions(space, count):
    """Random actions, drawn before the clock starts."""
    rng = np.random.default_rng(1)
    if isinstance(space, gymnasium.spaces.Discrete):
        return rng.integers(space.n, size=count)
    return rng.uniform(space.low, space.high, (count, *space.shape)).astype(np.float32)


def measure_gymnasium(name, steps):
    env = gymnasium.make(name, disable_env_checker=True)
    drawn = list(actions(env.action_space, steps))
    env.reset(seed=1)
    start = time.process_time()
    for action in drawn:
        *_, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return steps / (time.process_time() - start)


def measure_envpool(name, steps):
    env = envpool.make(name, env_type="gymnasium", num_envs=BATCH, num_threads=1, seed=1)
    calls = steps // BATCH
    drawn = actions(env.action_space, calls * BATCH)
    drawn = drawn.reshape(calls, BATCH, *drawn.shape[1:])
    env.reset()
    start = time.process_time()
    for batch in drawn:
        env.step(batch)
    rate = calls * BATCH / (time.process_time() - start)
    env.close()
    return rate


def measure_ours():
    """The table of the bench's section `tasks`: for each task `mj_step` alone, where there is one, and the task."""
    command = ["cargo", "bench", "--quiet", "-p", "tpg-trainer", "--bench", "training", "--", "tasks"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("|")]
    number = lambda cell: float(cell) if cell.isdigit() else None
    return {row[0]: (number(row[1]), number(row[2])) for row in cells if row[0] in TASKS}


def main():
    rounds = int(sys.argv[1])
    found = {task: [] for task in TASKS}
    for _ in range(rounds):
        ours = measure_ours()
        for task, (name, steps) in TASKS.items():
            found[task].append((*ours[task], measure_gymnasium(name, steps), measure_envpool(name, steps)))
    print(f"gymnasium {gymnasium.__version__}, envpool {envpool.__version__}, mujoco {mujoco.__version__}; thousand")
    print(f"control steps per CPU-second, one thread, random actions, medians of {rounds} rounds\n")
    print("| task | `mj_step` alone | this project | envpool | gymnasium | this / envpool | this / gymnasium |")
    print("|---|---|---|---|---|---|---|")
    for task, rows in found.items():
        middle = lambda value: statistics.median(value(row) for row in rows)
        bare = "–" if rows[0][0] is None else f"{middle(lambda r: r[0]) / 1e3:.1f}"
        print(
            f"| {task} | {bare} | {middle(lambda r: r[1]) / 1e3:.1f} | {middle(lambda r: r[3]) / 1e3:.1f}"
            f" | {middle(lambda r: r[2]) / 1e3:.1f} | {middle(lambda r: r[1] / r[3]):.2f} | {middle(lambda r: r[1] / r[2]):.2f} |"
        )


main()
