//! The tasks that are computed here: their physics alone, and training on CartPole.

use std::time::Duration;

use cpu_time::{ProcessTime, ThreadTime};
use tpg_runtime::Action;
use tpg_tasks::task::{ActionSpace, Rng, Task, create};
use tpg_trainer::session::Session;

use super::{config, median, rate};

const ROUNDS: usize = 5;
const STEPS: u32 = 2_000_000;
const GENERATIONS: u64 = 60;

/// Prints both tables.
pub fn print() {
    println!(
        "Physics of the native tasks, resets included, without a policy; medians of {ROUNDS} rounds\n"
    );
    println!("| task | million steps/CPU-s |\n|---|---|");
    for name in ["cartpole", "pendulum", "acrobot"] {
        let mut task = create(name).expect("a native task");
        let rates = (0..ROUNDS).map(|_| rate(u64::from(STEPS), step(&mut *task)) / 1e6);
        println!("| {name} | {:.1} |", median(rates.collect()));
    }
    println!(
        "\nTraining on CartPole, {GENERATIONS} generations of a preset, one thread; medians of {ROUNDS} rounds\n"
    );
    println!(
        "| preset | decisions | million decisions/CPU-s | scoring, % | lowering, % | loading, % | evolution, % |"
    );
    println!("|---|---|---|---|---|---|---|");
    for preset in ["cartpole-sr", "cartpole-sr-sm"] {
        let runs: Vec<[f64; 6]> = (0..ROUNDS).map(|_| train(preset)).collect();
        let middle = |k: usize| median(runs.iter().map(|run| run[k]).collect());
        println!(
            "| {preset} | {:.0} | {:.2} | {:.1} | {:.1} | {:.1} | {:.1} |",
            middle(0),
            middle(1) / 1e6,
            middle(2),
            middle(3),
            middle(4),
            middle(5)
        );
    }
    println!();
}

fn step(task: &mut dyn Task) -> Duration {
    let spec = task.spec();
    let (actions, limit) = (spec.actions, spec.max_steps);
    let torque = [0.5];
    let mut rng = Rng::new(1);
    let mut left = 0;
    let started = ThreadTime::now();
    for k in 0..STEPS {
        if left == 0 {
            task.reset(&mut rng);
            left = limit;
        }
        let action = match actions {
            ActionSpace::Discrete(_) => Action::Discrete((k % 2) as u16),
            ActionSpace::Continuous { .. } => Action::Continuous(&torque),
        };
        left = if task.step(action).terminated {
            0
        } else {
            left - 1
        };
    }
    started.elapsed()
}

/// Decisions, their rate, and shares of scoring, lowering, loading and evolution.
fn train(preset: &str) -> [f64; 6] {
    let mut session = Session::new(config(preset, &[]), 1).expect("a preset");
    let mut pool = session.pool(1).expect("a native task");
    let started = ProcessTime::now();
    for _ in 0..GENERATIONS {
        session.advance(&mut pool).expect("it can be scored");
    }
    let whole = started.elapsed();
    let (spent, overhead) = (pool.spent(), session.overhead().total());
    let share = |part: Duration| 100.0 * part.as_secs_f64() / whole.as_secs_f64();
    [
        session.steps() as f64,
        rate(session.steps(), whole),
        share(spent.episodes),
        share(spent.lowering),
        share(spent.loading),
        share(overhead),
    ]
}
