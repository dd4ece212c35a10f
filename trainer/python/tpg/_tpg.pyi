"""The compiled part of the package. Its classes are meant to be used through those of `tpg`."""

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt

_Bounds = tuple[float, float]
_Described = tuple[str, list[_Bounds], int, list[_Bounds], int, float]

__version__: str

def preset_names() -> list[str]:
    """Names of all presets: those with a task of the trainer's own, then variants for any task."""

def task_names() -> list[str]:
    """Full names of the built-in tasks of this build. A family is named by its default, such as `tmaze:10-v1`."""

def score_native(
    policy: Policy,
    task: str | None,
    *,
    observability: Sequence[str],
    disturb: Sequence[str],
    episodes: int,
    seed: int,
    threads: int,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Returns, lengths in steps, and executed instructions of each episode; see `tpg.evaluate_native`. Releases the GIL."""

def bootstrap_mean(values: Sequence[float] | npt.NDArray[np.float64]) -> tuple[float, float, float]:
    """Mean, and the bounds of its 95 % bootstrap interval."""

class Policy:
    def __new__(cls, source: str | PathLike[str] | bytes) -> Policy: ...
    def reset(self, seed: int = 0, *, agent: bool = True) -> None:
        """Begins an episode.

        Args:
            seed: of the random streams of memory, from 0 to 2**64 - 1.
            agent: whether it is the first episode. Later ones keep what the policy's scope of resets keeps between episodes.
        """

    def act(self, observation: npt.ArrayLike) -> Any:
        """Decides.

        Args:
            observation: of shape `(observation_len,)`.

        Returns:
            The index of the action as int, or its values: float32, of shape `(m,)`, within the policy's bounds.

        Raises:
            ValueError: the shape is wrong. TypeError: these are no real numbers. The state is unchanged then.
        """

    def reset_batch(self, seeds: Sequence[int], mask: npt.ArrayLike | None = None, *, agent: bool = True) -> None:
        """Begins episodes of a batch, in which each row has an agent of its own.

        Args:
            seeds: one for each row.
            mask: which rows begin an episode; all by default. Another number of rows than before needs all.
            agent: see `reset`.
        """

    def act_batch(self, observations: npt.ArrayLike) -> npt.NDArray[Any]:
        """Decides for all rows; releases the GIL.

        Args:
            observations: of shape `(rows, observation_len)`; row k is for the agent of seed k.

        Returns:
            Indices as int64, of shape `(rows,)`, or values as float32, of shape `(rows, m)`.
        """

    def to_bytes(self) -> bytes:
        """The bytes of the policy's file."""

    def disassemble(self) -> str:
        """Teams and programs as text."""

    @property
    def observation_len(self) -> int:
        """Numbers of an observation."""

    @property
    def task(self) -> str:
        """Name of the task that the policy was evolved for."""

    @property
    def observability(self) -> str:
        """What was hidden from it, such as `blackout:2/3`; empty if nothing was."""

    @property
    def period(self) -> float:
        """Seconds between two decisions."""

    @property
    def provenance(self) -> str:
        """32 hexadecimal digits: the hash of the configuration, seed and generation that made the policy."""

    @property
    def instructions(self) -> int:
        """Instructions that the last call of `act` executed."""

    @property
    def memory(self) -> npt.NDArray[np.float32]:
        """The memory that the policy's programs share, as it is now; a copy."""

    @property
    def bounds(self) -> dict[str, int]:
        """The most `instructions` of a decision, and the numbers of `teams`, `programs` and `state_bytes`."""

    _actions: tuple[int, list[_Bounds]]
    _input_bounds: list[_Bounds]
    _channels: list[tuple[str, str]]
    def _copy_state_of(self, other: Policy) -> None: ...
    def _export_c(self, name: str) -> tuple[str, str]: ...
    def _export_rust(self) -> str: ...

class Batch:
    episodes: int
    max_steps: int
    needs_rollout: str | None
    env_seeds: npt.NDArray[np.int64]
    policy_seeds: npt.NDArray[np.uint64]
    def __len__(self) -> int: ...
    def rollout(self, num_envs: int) -> Rollout: ...
    def _blob(self, number: int) -> bytes: ...
    @staticmethod
    def _of_policy(policy: Policy, task: _Described, observability: str, episodes: int, seed: int) -> Batch: ...

class Rollout:
    """The episodes of a batch, side by side in environments that step together.

    Again and again: reset what is `beginning`, `act` on all observations, step the environments, and tell by `step` what came of
    it, until `done`. Then give the rollout to `Evolution.tell`.
    """

    @property
    def done(self) -> bool:
        """Whether all episodes are done."""

    @property
    def active(self) -> npt.NDArray[np.bool_]:
        """Environments that have an episode, of shape `(num_envs,)`; the actions of others mean nothing."""

    def beginning(self) -> list[tuple[int, int]]:
        """Environments that are to begin an episode now, each with the seed to reset it with. Each is told once."""

    def act(self, observations: npt.ArrayLike, ready: npt.ArrayLike | None = None) -> npt.NDArray[Any]:
        """Decides for all environments; releases the GIL.

        Args:
            observations: flat ones, of shape `(num_envs, inputs)`.
            ready: environments that take part in this step, of shape `(num_envs,)`; all by default.

        Returns:
            As `Policy.act_batch`.
        """

    def step(self, rewards: npt.ArrayLike, done: npt.ArrayLike, ready: npt.ArrayLike | None = None) -> int:
        """Takes what a step gave, in arrays of shape `(num_envs,)`, and returns the number of episodes that it ended.

        Raises:
            ValueError: a shape is wrong, or a reward is not finite.
        """

    def results(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Returns, lengths in steps, and executed instructions, each of shape `(policies, episodes)`; once all are done."""

class Evolution:
    def __new__(
        cls,
        source: str | None,
        task: _Described,
        *,
        file: str | None = None,
        settings: Sequence[str] = (),
        seed: int = 0,
        folder: str | PathLike[str] | None = None,
        checkpoint: str | PathLike[str] | None = None,
        keep: tuple[int, int, int] = (1, 0, 20),
        budget: tuple[str, float] = ("generations", 100.0),
        command: Sequence[str] = (),
    ) -> Evolution: ...
    def ask(self) -> Any: ...
    def tell(self, answer: Rollout | npt.ArrayLike, lengths: npt.ArrayLike | None = None) -> dict[str, float] | None:
        """Answers the batch that was asked.

        Args:
            answer: a rollout that is done, or the returns of all episodes, of shape `(policies, episodes)`.
            lengths: with returns, the steps of these episodes, of the same shape.

        Returns:
            The generation's report if this completes one; its keys are the columns of the log.

        Raises:
            ValueError: the answer is not of the batch that was asked, or not finite. It can be told again.
            RuntimeError: nothing was asked, or the run is closed, or no team of the generation could be scored.
        """

    def close(self) -> None:
        """Ends the run. A generation that is not complete counts for nothing. Writes the last checkpoint of the folder."""

    def save(self, path: str | PathLike[str]) -> None:
        """Writes a checkpoint of the last complete generation, from which `load` goes on to the same bytes."""

    @property
    def generation(self) -> int:
        """Generations completed."""

    @property
    def steps(self) -> int:
        """Environment steps of all training episodes."""

    @property
    def seconds(self) -> float:
        """Seconds of training, over all resumes."""

    @property
    def seed(self) -> int:
        """The run's seed."""

    @property
    def config(self) -> str:
        """The resolved configuration, as TOML."""

    @property
    def progress(self) -> tuple[int, int]:
        """Episodes done in this generation, and those that it is known to need."""

    def _champion(self) -> bytes | None: ...
