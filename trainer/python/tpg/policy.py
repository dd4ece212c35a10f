"""Exported policies."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from tpg import _tpg


class Policy(_tpg.Policy):
    """An exported policy with the state of an agent that executes it.

    Args:
        source: path of a `.tpg` file, or its bytes.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no sound policy; the message says why.

    The policy decides as the trainer scored it, in every bit. It holds its own registers and memory, so one object serves one
    environment. For several, see `act_batch`. After construction it is reset with seed 0.

    Observations are arrays of shape `(observation_len,)`. float64 is rounded to float32 once, as the trainer does. Numbers that
    are not finite count as the runtime's semantics say (`docs/semantics.md`).
    """

    def __new__(cls, source: str | os.PathLike[str] | bytes) -> Policy:
        return super().__new__(cls, source)

    @property
    def observation_space(self) -> gymnasium.spaces.Box:
        """The observations: a Box of shape `(observation_len,)`, float32, with the ranges that the policy's file names.

        A policy takes values outside of them, too.
        """
        low, high = np.array(self._input_bounds, np.float32).T
        return gymnasium.spaces.Box(low, high, dtype=np.float32)

    @property
    def action_space(self) -> gymnasium.spaces.Discrete | gymnasium.spaces.Box:
        """The actions: `Discrete(n)`, or a Box of shape `(m,)`, float32, with the bounds of the policy's outputs."""
        count, bounds = self._actions
        if not bounds:
            return gymnasium.spaces.Discrete(count)
        low, high = np.array(bounds, np.float32).T
        return gymnasium.spaces.Box(low, high, dtype=np.float32)

    @property
    def spaces(self) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.Space]:
        """`(observation_space, action_space)`."""
        return self.observation_space, self.action_space

    @property
    def names(self) -> list[str]:
        """Name of each element of the observation, then of each continuous output."""
        return [name for name, _ in self._channels]

    @property
    def units(self) -> list[str]:
        """What 1.0 stands for, such as `m/s`, in the order of `names`."""
        return [unit for _, unit in self._channels]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file of the policy. Its state is no part of it."""
        Path(path).write_bytes(self.to_bytes())

    def export_c(self, path: str | os.PathLike[str]) -> tuple[Path, Path]:
        """Writes the policy as C99 code that decides alike, bit for bit: `path` with the suffixes `.h` and `.c`.

        Names in it begin with the file's, which must be an identifier. Returns both paths.
        """
        path = Path(path)
        if not (path.stem.isascii() and path.stem.isidentifier()):
            raise ValueError(
                f"cannot name a C module {path.stem!r}: give a file such as champion.c, whose name has only letters, digits and _"
            )
        header, source = self._export_c(path.stem)
        path.with_suffix(".h").write_text(header)
        path.with_suffix(".c").write_text(source)
        return path.with_suffix(".h"), path.with_suffix(".c")

    def export_rust(self, path: str | os.PathLike[str]) -> Path:
        """Writes the policy as a Rust module that needs `tpg-runtime` alone and decides alike, bit for bit."""
        path = Path(path)
        path.write_text(self._export_rust())
        return path

    def __copy__(self) -> Policy:
        copy = type(self)(self.to_bytes())
        copy._copy_state_of(self)
        return copy

    def __deepcopy__(self, _memo: dict[int, Any]) -> Policy:
        return self.__copy__()

    def __reduce__(self) -> tuple[type[Policy], tuple[bytes]]:
        # The state stays behind: an unpickled policy is one that was just loaded.
        return type(self), (self.to_bytes(),)

    def __repr__(self) -> str:
        return f"<tpg.Policy for {self.task}: {self.observation_len} inputs, {self.action_space}>"


class PolicyWrapper:
    """A policy with the method `predict` of Stable-Baselines3's models, so that code which evaluates those runs it.

    Args:
        policy: the policy, or the path or bytes of one.
        seed: of the policy's random streams; each episode and environment gets the next one.
    """

    def __init__(self, policy: Policy | str | os.PathLike[str] | bytes, seed: int = 0) -> None:
        self.policy = policy if isinstance(policy, Policy) else Policy(policy)
        self.observation_space, self.action_space = self.policy.spaces
        self._seed = seed

    def predict(
        self,
        observation: np.ndarray,
        state: Policy | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Policy]:
        """Decides for one environment, or for several.

        Args:
            observation: of shape `(observation_len,)`, or `(environments, observation_len)`.
            state: what the last call returned; `None` begins episodes in all environments.
            episode_start: which environments begin an episode, of shape `(environments,)`.
            deterministic: of no effect. Randomness in a policy is in its memory, and the seed fixes it.

        Returns:
            The action or actions, and the state for the next call, which is changed in place by it.
        """
        observation = np.asarray(observation)
        single = observation.ndim == 1
        rows = observation[None] if single else observation
        if state is None:
            state = Policy(self.policy.to_bytes())
            state.reset_batch(self._seeds(len(rows)))
        elif episode_start is not None and np.any(episode_start):
            starting = np.atleast_1d(np.asarray(episode_start, bool))
            state.reset_batch(self._seeds(len(rows)), starting, agent=False)
        actions = state.act_batch(rows)
        return (actions[0] if single else actions), state

    def _seeds(self, count: int) -> list[int]:
        self._seed += count
        return list(range(self._seed - count, self._seed))
