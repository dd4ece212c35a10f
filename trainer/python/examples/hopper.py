"""Runs the committed champion for Hopper, which sees nothing in 2 of 3 steps, in Gymnasium's Hopper-v5."""

from pathlib import Path

import tpg

champion = Path(__file__).parents[3] / "docs" / "champions" / "hopper-b23.tpg"
policy = tpg.Policy(champion)
scores = tpg.evaluate(policy, "Hopper-v5", episodes=20)
print(policy)
print(f"seen as evolved ({policy.observability}): mean return {scores.mean:.0f} {scores.interval}, iqm {scores.iqm:.0f}")
scores = tpg.evaluate(policy, "Hopper-v5", episodes=20, observability="none")
print(f"everything seen: mean return {scores.mean:.0f}, iqm {scores.iqm:.0f}")
