#!/usr/bin/env python3
"""Makes tests/golden/memory.json: episodes of the memory tasks, recorded from the packages that define them.

    python3.11 -m venv /tmp/memory && /tmp/memory/bin/pip install -r scripts/memory-golden.txt
    /tmp/memory/bin/python scripts/memory-golden.py [FILE]        (default: tests/golden/memory.json)

POPGym shuffles with NumPy and the trainer with a generator of its own. So an episode has the order of the cards, the initial state
or the cue, and the noise that was added. tests/tests/memory_tasks.rs starts from these, repeats the actions, and compares every
observation, reward and end, bit for bit.
"""

import copy
import json
import pathlib
import random
import sys

import numpy as np
import popgym.envs.autoencode as autoencode
import popgym.envs.count_recall as count_recall
import popgym.envs.noisy_position_only_cartpole as noisy_cartpole
import popgym.envs.noisy_position_only_pendulum as noisy_pendulum
import popgym.envs.position_only_cartpole as cartpole
import popgym.envs.position_only_pendulum as pendulum
import popgym.envs.repeat_first as repeat_first
import popgym.envs.repeat_previous as repeat_previous
from bsuite.environments.memory_chain import MemoryChain

RNG = random.Random(20261129)
LEVELS = ("easy", "medium", "hard")
# Steps recorded of plants whose observations are floats.
PLANT_STEPS = 40


def signs(rewards):
    """Rewards of one size as that size and a string of signs."""
    sizes = {abs(r) for r in rewards if r != 0}
    assert len(sizes) == 1, sizes
    return {"reward": sizes.pop(), "signs": "".join("0" if r == 0 else "+" if r > 0 else "-" for r in rewards)}


def cards(task, env, seed, answer):
    """An episode of a card game, which ends by itself. answer(env) is a right answer."""
    observation, _ = env.reset(seed=seed)
    decks = [d for d in (getattr(env, name, None) for name in ("deck", "value_deck", "query_deck")) if d is not None]
    episode = {"task": task, "orders": [deck.idx.tolist() for deck in decks], "limit": env.max_episode_length}
    observations, actions, rewards, terminated = [observation], [], [], False
    while not terminated:
        right = RNG.random() < 0.5
        action = answer(env) if right else RNG.randrange(int(env.action_space.n))
        observation, reward, terminated, truncated, _ = env.step(action)
        assert not truncated
        actions.append(int(action))
        rewards.append(float(reward))
        observations.append(observation)
    numbers = [np.atleast_1d(np.array(o, dtype=int)).tolist() for o in observations]
    return {**episode, "observations": numbers, "actions": actions, **signs(rewards)}


def plant(task, env, seed, reset_draws):
    """The first steps of an episode of a plant, with the noise that its generator gives."""
    env.reset(seed=seed)
    sigma = getattr(env, "noise_sigma", None)
    state = [float(x) for x in env.state] + [0.0, 0.0]
    episode = {"task": task, "state": state[:4], "limit": env.max_episode_length}
    steps = []
    for _ in range(PLANT_STEPS):
        if reset_draws == 4:
            action, given = (choice := RNG.randrange(2)), choice
        else:
            action = float(np.float32(RNG.uniform(-2, 2)))
            given = np.array([action], dtype=np.float32)
        noise = [0.0, 0.0]
        if sigma is not None:
            noise = copy.deepcopy(env.np_random).normal(0, sigma).astype(np.float32)
        observation, reward, terminated, _, _ = env.step(given)
        assert observation.dtype == np.float32, observation.dtype
        steps.append({
            "action": action, "noise": [float(x) for x in noise], "observation": [float(x) for x in observation],
            "reward": float(reward), "terminated": bool(terminated),
        })
        if terminated:
            break
    return {**episode, "steps": steps}


def chain(task, length, bits, seed):
    """Episodes of a memory chain."""
    env = MemoryChain(memory_length=length, num_bits=bits, seed=seed)
    for _ in range(2):
        step = env.reset()
        episode = {"task": task, "bits": [int(b) for b in env._context], "query": int(env._query)}
        observations, actions, rewards = [step.observation], [], []
        while not step.last():
            action = RNG.randrange(2)
            step = env.step(action)
            actions.append(action)
            rewards.append(float(step.reward))
            observations.append(step.observation)
        yield {**episode, "observations": [[float(x) for x in o[0]] for o in observations], "actions": actions, **signs(rewards)}


def suit(env):
    return int(env.deck.suits_idx[env.deck["player"][-env.k]]) if len(env.deck["player"]) >= env.k else 0


def reverse(env):
    return int(env.deck.suits_idx[env.deck["system"][-1]]) if env.mode == autoencode.Mode.PLAY else 0


def main():
    here = pathlib.Path(__file__).resolve().parent.parent
    path = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here / "tests/golden/memory.json"
    games, plants, chains = [], [], []
    for k, level in enumerate(LEVELS):
        word = level.capitalize()
        named = lambda module, name: getattr(module, name + word)()
        games.append(cards(f"repeat-first:{level}", named(repeat_first, "RepeatFirst"), k, lambda env: int(env.card)))
        games.append(cards(f"repeat-previous:{level}", named(repeat_previous, "RepeatPrevious"), k, suit))
        games.append(cards(f"autoencode:{level}", named(autoencode, "Autoencode"), k, reverse))
        games.append(cards(f"count-recall:{level}", named(count_recall, "CountRecall"), k, lambda env: int(env.counts[env.query])))
        for module, name, task, draws in (
            (cartpole, "PositionOnlyCartPole", "position-only-cartpole", 4),
            (noisy_cartpole, "NoisyPositionOnlyCartPole", "noisy-position-only-cartpole", 4),
            (pendulum, "PositionOnlyPendulum", "position-only-pendulum", 2),
            (noisy_pendulum, "NoisyPositionOnlyPendulum", "noisy-position-only-pendulum", 2),
        ):
            plants.append(plant(f"{task}:{level}", named(module, name), k, draws))
    for lag in (0, 1, 2):
        games.append(cards(f"repeat-previous:{lag}", repeat_previous.RepeatPrevious(1, lag + 1), 7 + lag, suit))
    for length in (1, 2, 9, 30):
        chains += chain(f"memory-len:{length}", length, 1, length)
    for bits in (1, 3, 10):
        chains += chain(f"memory-size:{bits}", 2, bits, 50 + bits)
    rows = lambda name, items: f'"{name}": [\n' + ",\n".join(json.dumps(item, separators=(",", ":")) for item in items) + "\n]"
    path.write_text("{\n" + ",\n".join([rows("games", games), rows("plants", plants), rows("chains", chains)]) + "\n}\n")


if __name__ == "__main__":
    main()
