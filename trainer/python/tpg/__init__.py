"""Tangled Program Graphs: use evolved policies anywhere, and train on any Gymnasium environment.

>>> import tpg
>>> policy = tpg.Policy("champion.tpg")                                 # doctest: +SKIP
>>> policy.reset(seed=1)                                                # doctest: +SKIP
>>> action = policy.act(observation)                                    # doctest: +SKIP
>>> result = tpg.train("CartPole-v1", preset="sr-sm", generations=20)   # doctest: +SKIP

`docs/python.md` in the repository is the guide.
"""

from tpg._tpg import Rollout, __version__, preset_names, task_names
from tpg.envs import EnvironmentFailed
from tpg.evaluation import Evaluation, evaluate, evaluate_native, iqm
from tpg.evolution import Batch, Evolution
from tpg.policy import Policy, PolicyWrapper
from tpg.training import Result, train

__all__ = [
    "Batch",
    "EnvironmentFailed",
    "Evaluation",
    "Evolution",
    "Policy",
    "PolicyWrapper",
    "Result",
    "Rollout",
    "__version__",
    "evaluate",
    "evaluate_native",
    "iqm",
    "preset_names",
    "task_names",
    "train",
]
