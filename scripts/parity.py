"""Writes trajectories of Gymnasium's environments, for tests/tests/parity.rs to replay.

usage: parity.py FOLDER STEPS [EPISODE [TASK...]]

One file of JSON lines for each task version, at least STEPS control steps in it, episodes of at most EPISODE steps.
Odd seeds go on past the end of the episode, where Gymnasium's unwrapped environments still move: states that no
short random episode reaches. Observations are rounded once to f32, as the tasks do; all else is exact.

The golden subset was written by:
  parity.py tests/golden/parity 320 80 cartpole-v1 inverted-double-pendulum-v{4,5} hopper-v{4,5} pendulum-v1
  parity.py tests/golden/parity 160 40 half-cheetah-v{4,5}
  parity.py tests/golden/parity 320 160 acrobot-v1
  parity.py tests/golden/parity 160 40 inverted-pendulum-v{4,5} walker2d-v{4,5} swimmer-v{4,5} reacher-v{4,5} pusher-v5 ant-v4
  parity.py tests/golden/parity 60 30 ant-v5
  parity.py tests/golden/parity 24 12 humanoid-v{4,5} humanoid-standup-v{4,5}
A step of a humanoid is 4 KB of JSON, more than ten of another robot's. So these four are short, and `scripts/parity` is what
compares thousands of their steps.
"""

import json
import pathlib
import sys

import gymnasium
import mujoco
import numpy as np

gymnasium.logger.min_level = gymnasium.logger.ERROR
# Else a warning about a deprecated attribute of half_cheetah.xml fills MUJOCO_LOG.TXT.
mujoco.set_mju_user_warning(lambda message: None)
PINNED = {"gymnasium": (gymnasium.__version__, "1.4.0"), "mujoco": (mujoco.__version__, "3.17.0")}


def short(values):
    """Rounds to f32 and writes the shortest digits that read back as it."""
    return [float(str(x)) for x in np.asarray(values, dtype=np.float64).astype(np.float32)]


def robot(name, seed, limit):
    """One episode under actions drawn past the range and clipped, so that the limits occur.

    The trajectory holds the policy's outputs, each within -1 and 1; the action is the output times the actuator's range,
    in f32 as in Gymnasium's action spaces where that is exact, else in f64 as MuJoCo's controls are.
    """
    env = gymnasium.make(name).unwrapped
    observation, _ = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    data = env.data
    scale = env.model.actuator_ctrlrange[:, 1]
    exact = all(np.log2(scale) % 1 == 0)
    line = {"seed": seed, "qpos": data.qpos.tolist(), "qvel": data.qvel.tolist(), "start": short(observation)}
    line |= {"actions": [], "observations": [], "rewards": [], "terminated": []}
    for _ in range(limit):
        output = rng.uniform(-1.2, 1.2, env.model.nu).astype(np.float32).clip(-1, 1)
        action = scale * output.astype(np.float64)
        observation, reward, terminated, _, _ = env.step(action.astype(np.float32) if exact else action)
        line["actions"].append(short(output))
        line["observations"].append(short(observation))
        line["rewards"].append(float(reward))
        line["terminated"].append(bool(terminated))
        if terminated and seed % 2 == 0:
            break
    return line


def balance(state, rng, seed):
    """A balancer of the cart's pole, clumsy on even seeds and blind on odd ones."""
    _, v, angle, omega = state
    clumsiness = 0.2 if seed % 2 == 0 else 1.0
    return int(angle + 0.5 * omega + 0.05 * v > 0) if rng.random() > clumsiness else int(rng.integers(2))


def swing(state, rng, _):
    """Pumps energy into the acrobot, clumsily."""
    return 1 + int(np.sign(state[3])) if rng.random() > 0.2 else int(rng.integers(3))


def whirl(state, rng, seed):
    """Drives the pendulum round and round on even seeds, at random on odd ones, past the range of the torque."""
    torque = rng.uniform(-2.5, 2.5)
    if seed % 2 == 0:
        torque = np.copysign(torque, state[1])
    return np.array([torque], dtype=np.float32)


def native(policy):
    """Episodes of a task that this project computes itself.

    Each step comes with its state, since an open loop would multiply any rounding error until nothing is left of it.
    """

    def play(name, seed, limit):
        env = gymnasium.make(name).unwrapped
        observation, _ = env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        line = {"seed": seed, "states": [env.state.tolist()], "start": short(observation)}
        line |= {"actions": [], "observations": [], "rewards": [], "terminated": []}
        for _ in range(limit):
            action = policy(env.state, rng, seed)
            observation, reward, terminated, _, _ = env.step(action)
            line["states"].append(env.state.tolist())
            line["actions"].append(action if isinstance(action, int) else short(action))
            line["observations"].append(short(observation))
            line["rewards"].append(float(reward))
            line["terminated"].append(bool(terminated))
            if terminated:
                break
        return line

    return play


TASKS = {
    "cartpole-v1": (native(balance), "CartPole-v1"),
    "acrobot-v1": (native(swing), "Acrobot-v1"),
    "pendulum-v1": (native(whirl), "Pendulum-v1"),
    "inverted-double-pendulum-v4": (robot, "InvertedDoublePendulum-v4"),
    "inverted-double-pendulum-v5": (robot, "InvertedDoublePendulum-v5"),
    "hopper-v4": (robot, "Hopper-v4"),
    "hopper-v5": (robot, "Hopper-v5"),
    "half-cheetah-v4": (robot, "HalfCheetah-v4"),
    "half-cheetah-v5": (robot, "HalfCheetah-v5"),
    "inverted-pendulum-v4": (robot, "InvertedPendulum-v4"),
    "inverted-pendulum-v5": (robot, "InvertedPendulum-v5"),
    "walker2d-v4": (robot, "Walker2d-v4"),
    "walker2d-v5": (robot, "Walker2d-v5"),
    "swimmer-v4": (robot, "Swimmer-v4"),
    "swimmer-v5": (robot, "Swimmer-v5"),
    "reacher-v4": (robot, "Reacher-v4"),
    "reacher-v5": (robot, "Reacher-v5"),
    "pusher-v5": (robot, "Pusher-v5"),
    "ant-v4": (robot, "Ant-v4"),
    "ant-v5": (robot, "Ant-v5"),
    "humanoid-v4": (robot, "Humanoid-v4"),
    "humanoid-v5": (robot, "Humanoid-v5"),
    "humanoid-standup-v4": (robot, "HumanoidStandup-v4"),
    "humanoid-standup-v5": (robot, "HumanoidStandup-v5"),
}


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    for package, (found, pinned) in PINNED.items():
        if found != pinned:
            sys.exit(f"parity.py: {package} is {found}, not {pinned}: run scripts/parity, which installs it")
    folder, least = pathlib.Path(sys.argv[1]), int(sys.argv[2])
    limit = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    names = sys.argv[4:] or list(TASKS)
    if unknown := [name for name in names if name not in TASKS]:
        sys.exit(f"parity.py: no task is called {unknown[0]}; tasks: {', '.join(TASKS)}")
    folder.mkdir(parents=True, exist_ok=True)
    for task in names:
        play, name = TASKS[task]
        steps = seed = 0
        with open(folder / f"{task}.jsonl", "w", encoding="ascii") as file:
            while steps < least:
                line = play(name, seed, limit)
                file.write(json.dumps(line, separators=(",", ":")) + "\n")
                steps += len(line["rewards"])
                seed += 1
        print(f"{task}: {steps} steps in {seed} episodes", file=sys.stderr)


main()
