"""Environments that run the episodes of a rollout in lock-step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from tpg._tpg import Rollout
from tpg.spaces import Declared, Task, check_numbers, flat_length, flattener, to_action, to_actions

#: What environments are made of: an id, or a function that makes an environment or a vector environment.
MakeEnv = str | Callable[[], Any]


class EnvironmentFailed(RuntimeError):
    """An environment raised an exception, or broke its own spaces. The cause is chained to it."""


def open_envs(make_env: MakeEnv, num_envs: int) -> Separate | Vector:
    """Makes the environments: `num_envs` of them, unless `make_env` makes a vector environment."""
    if num_envs < 1:
        raise ValueError(f"num_envs must be at least 1, not {num_envs}")
    if isinstance(make_env, str):
        name = make_env
        make_env = lambda: gymnasium.make(name)  # noqa: E731
    first = make_env()
    if isinstance(first, VectorEnv):
        return Vector(first)
    if not hasattr(first, "reset") or not hasattr(first, "step"):
        raise TypeError(f"make_env must return a Gymnasium environment, not {first!r}")
    envs = [first, *(make_env() for _ in range(num_envs - 1))]
    if len({id(env) for env in envs}) < num_envs:
        raise ValueError("make_env returned the same environment twice: it must make a new one at each call")
    return Separate(envs)


class Separate:
    """Environments of their own. Each episode is reset with its seed, so results do not depend on how many there are."""

    def __init__(self, envs: list[Any]) -> None:
        self.envs = envs
        self.num_envs = len(envs)
        self.example = envs[0]
        space = self.example.observation_space
        self._flatten = flattener(space)
        self._to_action = to_action(self.example.action_space)
        self._observations = np.zeros((self.num_envs, flat_length(space, type(self.example).__name__)))
        self._declared = [Declared(env) for env in envs]
        for k, declared in enumerate(self._declared):
            declared.expect(self._declared[0])
            _check_spaces(declared, k, wholly=True)

    def run(self, rollout: Rollout, tick: Callable[[], None] = lambda: None) -> None:
        """Runs all episodes of a rollout; calls `tick` at each step."""
        self._run(rollout, tick)
        for k, declared in enumerate(self._declared):
            _check_spaces(declared, k, wholly=True)

    def _run(self, rollout: Rollout, tick: Callable[[], None]) -> None:
        rewards, done = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        active = self._begin(rollout)
        while active:
            tick()
            actions = rollout.act(self._observations)
            for k in active:
                rewards[k], done[k] = self._step(k, actions[k])
            if rollout.step(rewards, done):
                active = self._begin(rollout)

    def _begin(self, rollout: Rollout) -> list[int]:
        for k, seed in rollout.beginning():
            try:
                observation, _ = self.envs[k].reset(seed=seed)
                self._observations[k] = self._flatten(observation)
            except Exception as error:
                raise _failed(k, f"at reset with seed {seed}", error) from error
            _check_spaces(self._declared[k], k)
        return np.flatnonzero(rollout.active).tolist()

    def _step(self, k: int, action: Any) -> tuple[float, bool]:
        try:
            observation, reward, terminated, truncated, _ = self.envs[k].step(self._to_action(action))
            self._observations[k] = self._flatten(observation)
        except Exception as error:
            raise _failed(k, "in a step", error) from error
        return reward, terminated or truncated

    def close(self) -> None:
        for env in self.envs:
            env.close()


class Vector:
    """A vector environment.

    With `AutoresetMode.DISABLED` each episode is reset with its seed, and results do not depend on the number of environments.
    In the other modes the environment begins episodes by itself: it is seeded at the start of each batch, so that results are
    repeatable, but they depend on the number of environments.
    """

    def __init__(self, env: VectorEnv) -> None:
        self.env = self.example = env
        self.num_envs = env.num_envs
        mode = (env.metadata or {}).get("autoreset_mode", AutoresetMode.NEXT_STEP)
        self._mode = AutoresetMode(mode)
        space = env.single_observation_space
        length = flat_length(space, type(env).__name__)
        if not isinstance(space, gymnasium.spaces.Box):
            raise TypeError(
                f"a vector environment must observe a Box, not {space}: wrap it in "
                "gymnasium.wrappers.vector.FlattenObservation"
            )
        self._shape = (self.num_envs, *space.shape)
        self._flat_shape = (self.num_envs, length)
        self._to_actions = to_actions(env.single_action_space)
        self._declared = Declared(env, "single_")

    def run(self, rollout: Rollout, tick: Callable[[], None] = lambda: None) -> None:
        """Runs all episodes of a rollout; calls `tick` at each step."""
        self._run(rollout, tick)
        _check_spaces(self._declared, None, wholly=True)

    def _run(self, rollout: Rollout, tick: Callable[[], None]) -> None:
        if self._mode == AutoresetMode.DISABLED:
            self._run_seeded(rollout, tick)
        else:
            self._run_streaming(rollout, tick)

    def _run_seeded(self, rollout: Rollout, tick: Callable[[], None]) -> None:
        seeds, over = [0] * self.num_envs, np.ones(self.num_envs, bool)
        while not rollout.done:
            tick()
            for k, seed in rollout.beginning():
                seeds[k], over[k] = seed, True
            if over.any():
                # Environments without work left are reset too: they step with the others.
                observations = self._reset(seed=list(seeds), options={"reset_mask": over})
            observations, rewards, over = self._step(rollout.act(observations))
            rollout.step(rewards, over)

    def _run_streaming(self, rollout: Rollout, tick: Callable[[], None]) -> None:
        first_seed = rollout.beginning()[0][1]
        observations = self._reset(seed=first_seed)
        # Environments whose observation belongs to the episode that the rollout expects.
        ready, resetting = np.ones(self.num_envs, bool), np.zeros(self.num_envs, bool)
        while not rollout.done:
            tick()
            observations, rewards, over = self._step(rollout.act(observations, ready))
            rollout.step(rewards, over, ready)
            if self._mode == AutoresetMode.NEXT_STEP:
                fresh, resetting = resetting, over
            else:
                fresh = over
            ready[[k for k, _ in rollout.beginning()]] = False
            ready |= fresh

    def _reset(self, **how: Any) -> np.ndarray:
        try:
            observations, _ = self.env.reset(**how)
        except Exception as error:
            raise _failed(None, "at reset", error) from error
        return self._flat(observations)

    def _step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        try:
            observations, rewards, terminated, truncated, _ = self.env.step(self._to_actions(actions))
        except Exception as error:
            raise _failed(None, "in a step", error) from error
        _check_spaces(self._declared, None)
        return self._flat(observations), rewards, np.logical_or(terminated, truncated)

    def _flat(self, observations: Any) -> np.ndarray:
        array = np.asarray(observations)
        if array.shape != self._shape:
            raise EnvironmentFailed(
                f"the observations of the vector environment have shape {array.shape}, but its space says {self._shape}"
            )
        try:
            check_numbers(array)
        except ValueError as error:
            raise _failed(None, "in its observations", error) from error
        return array.reshape(self._flat_shape)

    def close(self) -> None:
        self.env.close()


def _check_spaces(declared: Declared, k: int | None, *, wholly: bool = False) -> None:
    changed = declared.change(wholly)
    if changed is not None:
        who = "the vector environment" if k is None else f"environment {k}"
        raise EnvironmentFailed(f"{who} {changed}")


def _failed(k: int | None, when: str, error: Exception) -> EnvironmentFailed:
    who = "the vector environment" if k is None else f"environment {k}"
    return EnvironmentFailed(f"{who} failed {when}: {type(error).__name__}: {error}")


def describe(envs: Separate | Vector, name: str | None, max_steps: int | None, period: float | None) -> Task:
    """The task that opened environments are."""
    return Task.of(envs.example, name, max_steps, period)
