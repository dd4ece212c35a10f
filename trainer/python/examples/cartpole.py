"""Trains on CartPole, saves the champion, and scores it on fresh episodes."""

import sys

import tpg

generations = int(sys.argv[1]) if len(sys.argv) > 1 else 20
settings = {"evolution.population": 100, "evolution.children": 100}
result = tpg.train("CartPole-v1", "sr-sm", seed=1, generations=generations, settings=settings, progress=False)
scores = tpg.evaluate(result.policy, "CartPole-v1", episodes=50)
print(f"{result.generations} generations, {result.steps} steps: mean return {scores.mean:.1f}")
print(result.policy, result.policy.bounds)
result.policy.save("cartpole.tpg")
print(*(path.name for path in result.policy.export_c("cartpole.c")))
