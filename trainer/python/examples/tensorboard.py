"""Writes each generation's report for TensorBoard: `tensorboard --logdir runs`."""

import sys

from tensorboardX import SummaryWriter

import tpg

folder = sys.argv[1] if len(sys.argv) > 1 else "runs/cartpole"
generations = int(sys.argv[2]) if len(sys.argv) > 2 else 20

with SummaryWriter(folder) as writer:

    def report(row: dict[str, float], _: tpg.Evolution) -> None:
        for key in ("best", "mean", "teams", "programs", "instructions_mean"):
            writer.add_scalar(key, row[key], int(row["steps"]))

    tpg.train("CartPole-v1", "sr-sm", generations=generations, settings={"evolution.population": 60, "evolution.children": 60}, callback=report)
