"""CartPole-v1 to a mean return of 475: this package against Stable-Baselines3's PPO, in seconds of wall clock.

Needs `pip install stable-baselines3`, which brings torch: some 3 GB. No test runs it.
"""

import time

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import tpg

GOAL = 475
EPISODES = 50


def tpg_seconds(seed):
    found = None

    def reached(_, evolution):
        nonlocal found
        found = tpg.evaluate(evolution.champion, "CartPole-v1", episodes=EPISODES).mean >= GOAL
        return not found

    started = time.monotonic()
    settings = {"observability": []}
    tpg.train("CartPole-v1", "cartpole-champion", seed=seed, minutes=10, settings=settings, callback=reached, progress=False)
    return time.monotonic() - started if found else float("inf")


def ppo_seconds(seed):
    env, test = make_vec_env("CartPole-v1", n_envs=8, seed=seed), gymnasium.make("CartPole-v1")
    # The settings for CartPole in RL Baselines3 Zoo.
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=256, n_epochs=20, gae_lambda=0.8, gamma=0.98, seed=seed)
    started = time.monotonic()
    while time.monotonic() - started < 600:
        model.learn(5_000, reset_num_timesteps=False)
        if evaluate_policy(model, test, n_eval_episodes=EPISODES)[0] >= GOAL:
            return time.monotonic() - started
    return float("inf")


for seed in range(3):
    print(f"seed {seed}: tpg {tpg_seconds(seed):.1f} s, PPO {ppo_seconds(seed):.1f} s")
