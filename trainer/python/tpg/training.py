"""Training on Gymnasium environments."""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tqdm.auto import tqdm

from tpg.envs import MakeEnv, describe, open_envs
from tpg.evolution import Evolution
from tpg.policy import Policy

#: Generations of a run that names no budget.
DEFAULT_GENERATIONS = 100
#: Seconds between two looks of the progress bar at a generation that is not complete.
REFRESH = 0.5

#: Called after each generation with its report and the run; `False` ends the training.
Callback = Callable[[dict[str, float], Evolution], bool | None]


@dataclass
class Result:
    """What a training came to."""

    #: The best policy; `None` if no generation was completed.
    policy: Policy | None
    #: An array for each column of the log, with one element for each generation; `docs/training.md` explains the columns.
    log: dict[str, np.ndarray] = field(repr=False)
    #: Generations, environment steps and seconds, over all resumes.
    generations: int
    steps: int
    seconds: float
    #: The resolved configuration, as TOML.
    config: str = field(repr=False)
    #: The run's folder, if it has one.
    out: Path | None = None


class _TimeOver(Exception):
    """The minutes of a run are used up."""


def train(
    make_env: MakeEnv,
    preset: str = "sr-sm",
    *,
    seed: int = 0,
    generations: int | None = None,
    steps: int | None = None,
    minutes: float | None = None,
    num_envs: int = 16,
    settings: Mapping[str, Any] | None = None,
    config: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    callback: Callback | None = None,
    progress: bool = True,
    name: str | None = None,
    max_steps: int | None = None,
    period: float | None = None,
    log_every: int = 1,
    keep_champions: int = 0,
    checkpoint_every: int = 20,
) -> Result:
    """Trains policies on an environment and returns the best one.

    Args:
        make_env: id of an environment, or a function that makes an environment or a vector environment.
        preset: see `Evolution`; with `settings`, `config`, `seed` and `out`.
        generations, steps, minutes: when training ends, over the run's whole life; one of them, 100 generations by default.
            `steps` ends with the generation that reaches it. `minutes` ends at once, and a generation that is not complete
            then counts for nothing.
        num_envs: environments that step together. Each is made by its own call of `make_env`.
        resume: go on with the run in `out`, at its last checkpoint. Its settings and seed stay.
        callback: called after each generation with its report and the run; if it returns `False`, training ends.
        progress: whether to show a bar.
        name, max_steps, period: of the task, where the environment does not say. See `Evolution`.
        log_every, keep_champions, checkpoint_every: as the options of `tpg train`.

    Returns:
        A `Result`: the champion and the log.

    Raises:
        EnvironmentFailed: the environment raised an exception. The run's folder is complete up to the last generation.
        KeyboardInterrupt: likewise.
        ValueError, TypeError: see `Evolution`.

    One seed gives one champion for any `num_envs`, where the environment is deterministic and each episode can be seeded. That
    is so for environments by themselves and for vector environments that do not reset by themselves.
    """
    given = {"generations": generations, "steps": steps, "minutes": minutes}
    budgets = {kind: amount for kind, amount in given.items() if amount is not None}
    if len(budgets) > 1:
        raise ValueError(f"give one of generations, steps and minutes, not {' and '.join(budgets)}")
    kind, amount = next(iter(budgets.items()), ("generations", DEFAULT_GENERATIONS))
    if not 0 < amount < float("inf"):
        raise ValueError(f"{kind} must be above 0, not {amount}")
    if resume and out is None:
        raise ValueError("resume needs out, the folder of the run")
    envs = open_envs(make_env, num_envs)
    try:
        task = describe(envs, name, max_steps, period)
        spaces = task.observation_space, task.action_space
        about = {"name": task.name, "max_steps": task.max_steps, "period": task.period}
        if resume:
            evolution = Evolution.resume(out, *spaces, **about)
        else:
            evolution = Evolution(
                preset,
                *spaces,
                seed=seed,
                settings=settings,
                config=config,
                out=out,
                _budget=(kind, float(amount)),
                _keep=(log_every, keep_champions, checkpoint_every),
                **about,
            )
        with evolution:
            rows = _run(evolution, envs, kind, amount, callback, progress)
    finally:
        envs.close()
    columns = _read(Path(out) / "log.csv") if out is not None else _columns(rows)
    return Result(
        evolution.champion,
        columns,
        evolution.generation,
        evolution.steps,
        evolution.seconds,
        evolution.config,
        None if out is None else Path(out),
    )


def _run(
    evolution: Evolution, envs: Any, kind: str, amount: float, callback: Callback | None, progress: bool
) -> list[dict[str, float]]:
    """Asks and tells until the budget is used up; the reports of the generations."""
    rows: list[dict[str, float]] = []
    used: dict[str, Callable[[], float]] = {
        "generations": lambda: evolution.generation,
        "steps": lambda: evolution.steps,
        "minutes": lambda: evolution.seconds / 60,
    }
    end = time.monotonic() + 60 * amount - evolution.seconds if kind == "minutes" else float("inf")
    shown = time.monotonic()
    with tqdm(total=amount, initial=used[kind](), unit=f" {kind}", disable=not progress) as bar:

        def tick() -> None:
            nonlocal shown
            now = time.monotonic()
            if now > end:
                raise _TimeOver
            if now > shown + REFRESH:
                shown = now
                done, planned = evolution.progress
                bar.set_postfix_str(f"episode {done}/{planned} of generation {evolution.generation + 1}")

        while used[kind]() < amount:
            batch = evolution.ask()
            rollout = batch.rollout(envs.num_envs)
            try:
                envs.run(rollout, tick)
            except _TimeOver:
                break
            report = evolution.tell(rollout)
            if report is None:
                continue
            rows.append(report)
            bar.update(min(used[kind](), amount) - bar.n)
            bar.set_postfix_str(f"best {report['best']:.4g}, mean {report['mean']:.4g}")
            if callback is not None and callback(report, evolution) is False:
                break
    return rows


def _columns(rows: list[dict[str, float]]) -> dict[str, np.ndarray]:
    return {key: np.array([row[key] for row in rows]) for key in (rows[0] if rows else {})}


def _read(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    number = lambda text: float(text) if text else float("nan")  # noqa: E731
    return {key: np.array([number(row[key]) for row in rows]) for key in (rows[0] if rows else {})}
