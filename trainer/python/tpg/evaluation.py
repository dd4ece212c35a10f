"""Scores of policies, as this field reports them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tpg import _tpg
from tpg.envs import MakeEnv, describe, open_envs
from tpg.policy import Policy


@dataclass
class Evaluation:
    """Test episodes of a policy."""

    #: float64, one for each episode.
    returns: np.ndarray = field(repr=False)
    #: Steps, int64, one for each episode.
    lengths: np.ndarray = field(repr=False)
    #: Instructions that the policy executed for each decision, on average.
    instructions_mean: float
    #: Mean return, and its 95 % bootstrap interval.
    mean: float
    interval: tuple[float, float]
    #: Interquartile mean of the returns.
    iqm: float


def evaluate(
    policy: Policy | str | os.PathLike[str],
    make_env: MakeEnv,
    *,
    episodes: int = 20,
    seed: int = 0,
    num_envs: int = 16,
    observability: str | None = None,
    name: str | None = None,
    max_steps: int | None = None,
    period: float | None = None,
) -> Evaluation:
    """Scores a policy on test episodes, whose seeds are none of training.

    Args:
        policy: the policy, or the path of one.
        make_env: see `train`.
        episodes: how many. Episode k of a seed is the same for every policy.
        observability: what the policy sees, such as `"none"` or `"blackout:2/3"`; by default as it was evolved.
        name, max_steps, period: see `train`.

    Raises:
        ValueError: the policy does not fit the environment; the message says where.
        EnvironmentFailed: the environment raised an exception.
    """
    policy = policy if isinstance(policy, Policy) else Policy(policy)
    envs = open_envs(make_env, min(num_envs, episodes))
    try:
        task = describe(envs, name, max_steps, period)
        seen = policy.observability if observability is None else observability
        batch = _tpg.Batch._of_policy(policy, task.described(), seen or "none", episodes, seed)
        rollout = batch.rollout(envs.num_envs)
        envs.run(rollout)
    finally:
        envs.close()
    return _evaluation(*(array[0] for array in rollout.results()))


def evaluate_native(
    policy: Policy | str | os.PathLike[str],
    task: str | None = None,
    *,
    episodes: int = 20,
    seed: int = 0,
    threads: int = 1,
    observability: str | Sequence[str] = (),
    disturb: str | Sequence[str] = (),
) -> Evaluation:
    """Scores a policy on a task that is built in, as the command `tpg eval` does: with the same episodes and returns, in every
    bit. The episodes run without Python, and its other threads go on meanwhile.

    Args:
        policy: the policy, or the path of one.
        task: such as `"cartpole"` or `"tmaze:100"`; by default the task that it was evolved for. `tpg.task_names()` lists all.
        episodes: how many. Episode k of a seed is the same for every policy.
        threads: how many to run the episodes in. The result does not depend on it.
        observability: what the policy sees, such as `"none"` or `"blackout:2/3"`; by default as it was evolved.
        disturb: what happens on the link to the policy, such as `"noise:0.01"`, as the option of `tpg eval`.

    Raises:
        ValueError: there is no such task in this build, or the policy does not fit it; the message says which and why.
        KeyboardInterrupt: within a second.
    """
    policy = policy if isinstance(policy, Policy) else Policy(policy)
    seen = [observability] if isinstance(observability, str) else list(observability)
    disturbed = [disturb] if isinstance(disturb, str) else list(disturb)
    scores = _tpg.score_native(
        policy, task, observability=seen, disturb=disturbed, episodes=episodes, seed=seed, threads=threads
    )
    return _evaluation(*scores)


def _evaluation(returns: np.ndarray, lengths: np.ndarray, instructions: np.ndarray) -> Evaluation:
    mean, low, high = _tpg.bootstrap_mean(returns)
    return Evaluation(returns, lengths, instructions.sum() / lengths.sum(), mean, (low, high), iqm(returns))


def iqm(scores: Sequence[float] | np.ndarray, confidence: float | None = None, resamples: int = 2000, seed: int = 0) -> float | tuple[float, float, float]:
    """The interquartile mean: the mean of the middle half of all scores (Agarwal et al. 2021, "Deep Reinforcement Learning at the
    Edge of the Statistical Precipice").

    Args:
        scores: of shape `(runs,)`, or `(runs, tasks)` with scores of equal scale in all tasks.
        confidence: such as 0.95, to get the bounds of a bootstrap interval too. Runs are resampled within each task.

    Returns:
        The mean, or `(mean, low, high)`.
    """
    scores = np.asarray(scores, float)
    if scores.size == 0 or scores.ndim > 2:
        raise ValueError(f"scores must have shape (runs,) or (runs, tasks), and not {scores.shape}")
    if not np.isfinite(scores).all():
        raise ValueError("scores must be finite")

    def mean(values: np.ndarray) -> float:
        ordered = np.sort(values, axis=None)
        cut = ordered.size // 4
        return float(ordered[cut : ordered.size - cut].mean())

    if confidence is None:
        return mean(scores)
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, not {confidence}")
    table = scores[:, None] if scores.ndim == 1 else scores
    rng = np.random.default_rng(seed)
    drawn = rng.integers(len(table), size=(resamples, *table.shape))
    means = [mean(np.take_along_axis(table, rows, axis=0)) for rows in drawn]
    tail = (1 - confidence) / 2
    low, high = np.quantile(means, [tail, 1 - tail])
    return mean(scores), float(low), float(high)
