"""Shows a policy in MuJoCo's viewer, in real time. With a number of steps as argument it runs without a window."""

import sys
import time
from pathlib import Path

import gymnasium
import mujoco.viewer

import tpg

policy = tpg.Policy(Path(__file__).parents[3] / "docs" / "champions" / "hopper-b23.tpg")
env = gymnasium.make("Hopper-v5")
inner = env.unwrapped
steps = int(sys.argv[1]) if len(sys.argv) > 1 else None
viewer = None if steps else mujoco.viewer.launch_passive(inner.model, inner.data)

observation, _ = env.reset(seed=1)
policy.reset(seed=1)
step = total = 0
while (viewer.is_running() if viewer else step < steps):
    started = time.monotonic()
    observation, reward, terminated, truncated, _ = env.step(policy.act(observation))
    step, total = step + 1, total + reward
    if viewer:
        viewer.sync()
        time.sleep(max(0.0, policy.period - (time.monotonic() - started)))
    if terminated or truncated:
        print(f"return {total:.0f}")
        observation, total = env.reset()[0], 0
        policy.reset(seed=step, agent=False)
print(f"{step} steps")
