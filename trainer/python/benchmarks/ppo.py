"""CartPole-v1 to a mean return of 475 over 50 fresh episodes: this package against Stable-Baselines3's PPO.

Needs `pip install stable-baselines3`, which brings torch: some 3 GB. No test runs it. Both are given one thread. Times hold
the tests after each generation, or after each 5 000 steps of PPO. CPU time says more than wall clock on a machine that is busy.
"""

import sys
import time

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import tpg

GOAL = 475
EPISODES = 50
#: Seconds of wall clock after which one gives up.
LIMIT = 600
SEEDS = int(sys.argv[1]) if len(sys.argv) > 1 else 3


def measured(learn):
    """CPU seconds, wall-clock seconds and environment steps until `learn` reached the goal; its result is whether and the steps."""
    cpu, wall = time.process_time(), time.monotonic()
    reached, steps = learn()
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    return f"{cpu:.1f} s of CPU, {wall:.1f} s, {steps:,} steps" if reached else f"not in {wall:.0f} s"


def with_tpg(make, seed):
    """Trains with this package. `make` makes an environment, or a vector of them."""
    found = False

    def reached(_, evolution):
        nonlocal found
        found = tpg.evaluate(evolution.champion, "CartPole-v1", episodes=EPISODES).mean >= GOAL
        return not found

    settings = {"observability": []}
    result = tpg.train(
        make, "cartpole-champion", seed=seed, minutes=LIMIT / 60, settings=settings, callback=reached, progress=False
    )
    return found, result.steps


def with_ppo(seed):
    """Trains with the settings for CartPole of RL Baselines3 Zoo, at a constant rate of learning."""
    env, test = make_vec_env("CartPole-v1", n_envs=8, seed=seed), gymnasium.make("CartPole-v1")
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=256, n_epochs=20, gae_lambda=0.8, gamma=0.98, seed=seed, device="cpu")
    started = time.monotonic()
    while time.monotonic() - started < LIMIT:
        model.learn(5_000, reset_num_timesteps=False)
        if evaluate_policy(model, test, n_eval_episodes=EPISODES)[0] >= GOAL:
            return True, model.num_timesteps
    return False, model.num_timesteps


def vector():
    return gymnasium.make_vec("CartPole-v1", 64, vectorization_mode="vector_entry_point")


torch.set_num_threads(1)
for seed in range(SEEDS):
    print(f"seed {seed}:", flush=True)
    print(f"  tpg, 16 environments: {measured(lambda: with_tpg('CartPole-v1', seed))}", flush=True)
    print(f"  tpg, a vector of 64:  {measured(lambda: with_tpg(vector, seed))}", flush=True)
    print(f"  PPO, 8 environments:  {measured(lambda: with_ppo(seed))}", flush=True)
