"""CartPole-v1 to a mean return of 475 over 50 fresh episodes: this package against Stable-Baselines3's PPO.

Needs `pip install stable-baselines3`, which brings torch: some 3 GB. No test runs it. Both are given one thread. Times hold
the tests after each generation, or after each 5 000 steps of PPO. CPU time says more than wall clock on a machine that is busy.
"""

import sys
import time

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import tpg

GOAL = 475
EPISODES = 50
#: Environment steps after which this package gives up.
LIMIT = 5_000_000
SEEDS = int(sys.argv[1]) if len(sys.argv) > 1 else 3


def measured(learn):
    """CPU seconds, wall-clock seconds and environment steps until `learn` reached the goal; its result is whether and the steps."""
    cpu, wall = time.process_time(), time.monotonic()
    reached, steps = learn()
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    return f"{'' if reached else 'not in '}{cpu:.1f} s of CPU, {wall:.1f} s, {steps:,} steps"


def with_tpg(make, seed):
    """Trains with this package. `make` makes an environment, or a vector of them."""
    found = False

    def reached(_, evolution):
        nonlocal found
        found = tpg.evaluate(evolution.champion, "CartPole-v1", episodes=EPISODES).mean >= GOAL
        return not found

    settings = {"observability": []}
    result = tpg.train(
        make, "cartpole-champion", seed=seed, steps=LIMIT, settings=settings, callback=reached, progress=False
    )
    return found, result.steps


class Test(BaseCallback):
    """Ends learning once the mean return is reached, which it looks at each 5 000 steps."""

    def __init__(self):
        super().__init__()
        self.env, self.next, self.found = gymnasium.make("CartPole-v1"), 5_000, False

    def _on_step(self):
        if self.num_timesteps >= self.next:
            self.next += 5_000
            self.found = evaluate_policy(self.model, self.env, n_eval_episodes=EPISODES)[0] >= GOAL
        return not self.found


def with_ppo(seed):
    """Trains with the settings for CartPole of RL Baselines3 Zoo, for its 100 000 steps at most."""
    env, test = make_vec_env("CartPole-v1", n_envs=8, seed=seed), Test()
    size = {"n_steps": 32, "batch_size": 256, "n_epochs": 20, "gae_lambda": 0.8, "gamma": 0.98}
    rates = {"learning_rate": lambda left: 1e-3 * left, "clip_range": lambda left: 0.2 * left}
    model = PPO("MlpPolicy", env, seed=seed, device="cpu", **size, **rates)
    model.learn(100_000, callback=test)
    return test.found, model.num_timesteps


def vector():
    return gymnasium.make_vec("CartPole-v1", 64, vectorization_mode="vector_entry_point")


torch.set_num_threads(1)
for seed in range(SEEDS):
    print(f"seed {seed}:", flush=True)
    print(f"  tpg, 16 environments: {measured(lambda: with_tpg('CartPole-v1', seed))}", flush=True)
    print(f"  tpg, a vector of 64:  {measured(lambda: with_tpg(vector, seed))}", flush=True)
    print(f"  PPO, 8 environments:  {measured(lambda: with_ppo(seed))}", flush=True)
