"""Searches hyper-parameters with Optuna. Trials whose champions lag behind are pruned."""

import sys

import optuna

import tpg

GENERATIONS = int(sys.argv[1]) if len(sys.argv) > 1 else 20
TRIALS = int(sys.argv[2]) if len(sys.argv) > 2 else 20


def objective(trial: optuna.Trial) -> float:
    settings = {
        "evolution.population": trial.suggest_int("population", 20, 100),
        "evolution.children": trial.suggest_int("children", 20, 100),
        "evolution.team.crossover": trial.suggest_float("crossover", 0.0, 1.0),
        "evaluation.episodes": 2,
    }

    def report(row: dict[str, float], _: tpg.Evolution) -> None:
        trial.report(row["best"], int(row["generation"]))
        if trial.should_prune():
            raise optuna.TrialPruned

    result = tpg.train("CartPole-v1", "sr-sm", generations=GENERATIONS, settings=settings, callback=report, progress=False)
    return tpg.evaluate(result.policy, "CartPole-v1", episodes=10).mean


study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=1))
study.optimize(objective, n_trials=TRIALS)
print(f"best mean return {study.best_value:.1f} with {study.best_params}")
