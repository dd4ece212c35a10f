"""Gymnasium's spaces as policies see them: flat observations, and an index or a vector of values as the action."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

#: Lowest and highest of a value.
Bounds = tuple[float, float]
#: Steps after which an episode ends, where neither environment nor caller say.
MAX_STEPS = 10_000
#: Seconds between two decisions, where neither environment nor caller say.
PERIOD = 0.02


@dataclass(frozen=True)
class Task:
    """What evolution needs to know of an environment."""

    name: str
    observation_space: spaces.Space
    action_space: spaces.Space
    max_steps: int = MAX_STEPS
    period: float = PERIOD

    @classmethod
    def of(
        cls, env: Any, name: str | None = None, max_steps: int | None = None, period: float | None = None
    ) -> Task:
        """Describes an environment or vector environment; arguments that are given win over what it says of itself."""
        spec = getattr(env, "spec", None)
        inner = getattr(env, "unwrapped", env)
        return cls(
            name or (spec.id if spec is not None else type(inner).__name__),
            getattr(env, "single_observation_space", env.observation_space),
            getattr(env, "single_action_space", env.action_space),
            max_steps or getattr(spec, "max_episode_steps", None) or MAX_STEPS,
            period or _period(env, inner),
        )

    def described(self) -> tuple[str, list[Bounds], int, list[Bounds], int, float]:
        """The form in which the compiled part takes it.

        Raises:
            TypeError: a space cannot be flattened, or actions are neither Discrete nor a Box.
            ValueError: a value of an action has no bounds.
        """
        inputs = _observations(self.observation_space, self.name)
        indices, values = _actions(self.action_space, self.name)
        return self.name, inputs, indices, values, self.max_steps, self.period


def _period(env: Any, inner: Any) -> float:
    step = getattr(inner, "dt", None)
    if isinstance(step, (int, float)) and step > 0:
        return float(step)
    rate = (getattr(env, "metadata", None) or {}).get("render_fps")
    return 1 / rate if rate else PERIOD


def flat_length(space: spaces.Space, name: str) -> int:
    """Numbers of a flat observation. A Discrete space is one number for each value, one of which is 1."""
    if isinstance(space, spaces.Box) and not np.issubdtype(space.dtype, np.number):
        raise TypeError(f"{name}: observations of {space.dtype} are no numbers")
    if not space.is_np_flattenable:
        raise TypeError(
            f"{name}: the observation space {space} cannot be flattened to numbers; wrap the environment so that it "
            "observes a Box, Discrete, or a Dict or Tuple of these"
        )
    return spaces.flatdim(space)


def _observations(space: spaces.Space, name: str) -> list[Bounds]:
    """The bounds of each number of a flat observation."""
    flat_length(space, name)
    flat = spaces.flatten_space(space)
    return _bounds(flat)


def _bounds(box: spaces.Box) -> list[Bounds]:
    # Bounds of 64 bits that 32 bits do not hold become infinite, as the values do.
    with np.errstate(over="ignore"):
        low, high = (bound.reshape(-1).astype(np.float32).tolist() for bound in (box.low, box.high))
    return list(zip(low, high, strict=True))


def _actions(space: spaces.Space, name: str) -> tuple[int, list[Bounds]]:
    """The number of indices, or the bounds of each value."""
    if isinstance(space, spaces.Discrete):
        return int(space.n), []
    if not isinstance(space, spaces.Box):
        raise TypeError(f"{name}: the action space {space} is neither Discrete nor a Box; wrap the environment")
    if not np.issubdtype(space.dtype, np.floating):
        raise TypeError(f"{name}: actions of {space.dtype} are not supported; wrap the environment")
    bounds = _bounds(space)
    if not bounds or not np.isfinite(bounds).all():
        raise ValueError(
            f"{name}: an action must have values, all of them with finite bounds, not {_in_full(space)}; wrap the environment"
        )
    return 0, bounds


class Declared:
    """The spaces of an environment as they were when it was opened. What is trained on it counts on them to stay.

    Args:
        env: the environment.
        prefix: of its attributes, such as `"single_"` for one of a vector.
    """

    def __init__(self, env: Any, prefix: str = "") -> None:
        self._env = env
        self._attributes = [f"{prefix}observation_space", f"{prefix}action_space"]
        self._seen = [getattr(env, attribute) for attribute in self._attributes]
        # Copies, since a space can be changed in place.
        self._opened = copy.deepcopy(self._seen)

    def expect(self, other: Declared) -> None:
        """From now on the spaces have to be those of another environment."""
        self._opened = other._opened

    def change(self, wholly: bool = False) -> str | None:
        """How a space differs from what it has to be, in words: in its kind, shape, type of numbers, or bounds.

        It costs little, but misses changes within a space, unless `wholly` is true.
        """
        for k, attribute in enumerate(self._attributes):
            space, opened = getattr(self._env, attribute), self._opened[k]
            if space is self._seen[k] and not wholly:
                continue
            if type(space) is not type(opened) or space != opened:
                return f"has the {attribute} {_in_full(space)}, but it must stay {_in_full(opened)}"
            self._seen[k] = space
        return None


def _in_full(space: spaces.Space) -> str:
    """A space as text. That of a Box names one bound for all of its values, so the others are added."""
    if isinstance(space, spaces.Box) and not (np.ptp(space.low) == 0 and np.ptp(space.high) == 0):
        return f"{space} from {space.low.tolist()} to {space.high.tolist()}"
    return str(space)


def check_numbers(array: np.ndarray) -> None:
    """Raises `ValueError` for an observation of anything else than real numbers."""
    if array.dtype.kind not in "fiub":
        raise ValueError(f"the observation is of {array.dtype}, which is no type of real numbers")


def flattener(space: spaces.Space) -> Callable[[Any], np.ndarray]:
    """A function from an observation to its flat form. It raises `ValueError` if the observation is not of the space's shape, or
    of no real numbers."""
    length = spaces.flatdim(space)

    def box(observation: Any) -> np.ndarray:
        array = np.asarray(observation)
        if array.shape != space.shape:
            raise ValueError(f"the observation has shape {array.shape}, but its space says {space.shape}")
        check_numbers(array)
        return array.reshape(-1)

    def other(observation: Any) -> np.ndarray:
        flat = spaces.flatten(space, observation)
        if np.shape(flat) != (length,):
            raise ValueError(f"the observation {observation!r} is not of its space {space}")
        return flat

    return box if isinstance(space, spaces.Box) else other


def to_action(space: spaces.Space) -> Callable[[Any], Any]:
    """A function from a policy's action to the environment's."""
    if isinstance(space, spaces.Discrete):
        start = int(space.start)
        return lambda action: int(action) + start
    shape, dtype = space.shape, space.dtype
    return lambda action: action.reshape(shape).astype(dtype, copy=False)


def to_actions(space: spaces.Space) -> Callable[[np.ndarray], np.ndarray]:
    """The same for the actions of a vector environment, of which each row is one."""
    if isinstance(space, spaces.Discrete):
        start = space.start
        return lambda actions: (actions + start).astype(space.dtype, copy=False)
    shape, dtype = space.shape, space.dtype
    return lambda actions: actions.reshape(-1, *shape).astype(dtype, copy=False)
