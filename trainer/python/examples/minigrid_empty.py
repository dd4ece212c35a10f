"""Trains on an environment of another package: MiniGrid's empty room, its image flattened to 147 inputs."""

import sys

import gymnasium
import minigrid  # noqa: F401 (registers its environments)
from minigrid.wrappers import ImgObsWrapper

import tpg

generations = int(sys.argv[1]) if len(sys.argv) > 1 else 20


def make() -> gymnasium.Env:
    return gymnasium.wrappers.FlattenObservation(ImgObsWrapper(gymnasium.make("MiniGrid-Empty-5x5-v0")))


settings = {"policy.width": 16, "evolution.population": 60, "evolution.children": 60, "evaluation.episodes": 2}
result = tpg.train(make, "sr-sm", generations=generations, settings=settings, max_steps=100, progress=False)
print(f"{result.policy.observation_len} inputs, {result.policy.action_space}")
print(f"mean return {tpg.evaluate(result.policy, make, max_steps=100).mean:.2f}")
