"""Evolution that asks for scores and is told them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium

from tpg import _tpg
from tpg.policy import Policy
from tpg.spaces import MAX_STEPS, PERIOD, Task


class Batch:
    """Policies that evolution asks to be scored: the answer to `Evolution.ask`.

    `batch[k]` is policy k. Each policy runs `episodes` episodes. In episode e of policy k the environment is reset with
    `env_seeds[k, e]`, and the policy with `policy_seeds[k, e]`, by `reset(seed, agent=e == 0)`. An episode ends after
    `max_steps` steps at the latest.

    A generation asks for one batch or several: trials of tuning, its new teams, and races for champion.
    """

    def __init__(self, native: _tpg.Batch) -> None:
        self._native = native
        self.episodes: int = native.episodes
        self.max_steps: int = native.max_steps
        #: int64, of shape `(policies, episodes)`, below 2**31.
        self.env_seeds = native.env_seeds
        #: uint64, of shape `(policies, episodes)`.
        self.policy_seeds = native.policy_seeds

    def __len__(self) -> int:
        return len(self._native)

    def __getitem__(self, k: int) -> Policy:
        if k < 0:
            k += len(self)
        if not 0 <= k < len(self):
            raise IndexError(f"there is no policy {k}: the batch has {len(self)}")
        return Policy(self._native._blob(k))

    def __iter__(self) -> Iterator[Policy]:
        return (self[k] for k in range(len(self)))

    @property
    def needs_rollout(self) -> str | None:
        """Why `tell` takes only a rollout for this batch; `None` if it takes returns too."""
        return self._native.needs_rollout

    def rollout(self, num_envs: int) -> _tpg.Rollout:
        """The episodes of the batch, side by side in `num_envs` environments that step together."""
        return self._native.rollout(num_envs)


class Evolution(_tpg.Evolution):
    """A training run that does not run episodes itself: `ask` for policies, score them, `tell` what they returned.

    Args:
        preset: such as `"sr-sm"`; `tpg.preset_names()` lists all. The task of a preset that names one is not used.
        observation_space: of the environment; flattened, so that each number is an input of the policies.
        action_space: `Discrete`, or a Box with finite bounds.
        seed: fixes the run.
        settings: keys of the configuration with values, such as `{"evolution.population": 100}`.
        config: path of a TOML file of settings.
        out: folder for champion, log, checkpoint and configuration, as `tpg train --out` makes it.
        name: of the task, which champions carry.
        max_steps: steps after which an episode ends at the latest.
        period: seconds between two decisions, which champions carry.

    Raises:
        ValueError, TypeError: settings or spaces make no sense; the message says which and what would be right.

    The run lives in a thread that sleeps while it waits for answers. `close` ends it, and so does the end of a `with` block.
    """

    def __new__(
        cls,
        preset: str,
        observation_space: gymnasium.Space,
        action_space: gymnasium.Space,
        *,
        seed: int = 0,
        settings: Mapping[str, Any] | None = None,
        config: str | os.PathLike[str] | None = None,
        out: str | os.PathLike[str] | None = None,
        name: str = "environment",
        max_steps: int = MAX_STEPS,
        period: float = PERIOD,
        _budget: tuple[str, float] = ("generations", 100.0),
        _keep: tuple[int, int, int] = (1, 0, 20),
    ) -> Evolution:
        task = Task(name, observation_space, action_space, max_steps, period)
        return super().__new__(
            cls,
            preset,
            task.described(),
            file=None if config is None else Path(config).read_text(),
            settings=[f"{key}={_toml(value)}" for key, value in (settings or {}).items()],
            seed=seed,
            folder=out,
            keep=_keep,
            budget=_budget,
            command=["tpg.train", preset, f"out={out}", f"seed={seed}"],
        )

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        observation_space: gymnasium.Space,
        action_space: gymnasium.Space,
        *,
        name: str = "environment",
        max_steps: int = MAX_STEPS,
        period: float = PERIOD,
    ) -> Evolution:
        """Goes on with a run that `save` wrote. The environment must be the same one."""
        task = Task(name, observation_space, action_space, max_steps, period)
        return _tpg.Evolution.__new__(cls, None, task.described(), checkpoint=path)

    @classmethod
    def resume(
        cls,
        out: str | os.PathLike[str],
        observation_space: gymnasium.Space,
        action_space: gymnasium.Space,
        *,
        name: str = "environment",
        max_steps: int = MAX_STEPS,
        period: float = PERIOD,
    ) -> Evolution:
        """Goes on with the run in a folder, at its last checkpoint. The environment must be the same one."""
        task = Task(name, observation_space, action_space, max_steps, period)
        return _tpg.Evolution.__new__(cls, None, task.described(), folder=out)

    def ask(self) -> Batch:
        """The policies to be scored next. Asked again before `tell`, it gives the same ones."""
        return Batch(super().ask())

    @property
    def champion(self) -> Policy | None:
        """The best policy of the last complete generation; `None` before the first."""
        blob = self._champion()
        return None if blob is None else Policy(blob)

    def __enter__(self) -> Evolution:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _toml(value: Any) -> str:
    """A value as TOML; text stays as it is."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_quoted(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_quoted(item) for item in value) + "]"
    return repr(getattr(value, "item", lambda: value)())


def _quoted(value: Any) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(value, str) else _toml(value)
