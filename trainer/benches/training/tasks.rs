//! The tasks under random actions, MuJoCo's robots beside `mj_step` on the same states. `scripts/bench-peers` reads this
//! table.

use std::time::Duration;

use cpu_time::ThreadTime;
use tpg_runtime::Action;
use tpg_tasks::task::{ActionSpace, Rng, Task, create};

use super::replay::{self, DOUBLE_PENDULUM, HALF_CHEETAH, HOPPER, Recording, Robot, Tape};
use super::{median, rate};

const ROUNDS: usize = 3;

/// A task, its robot if it is MuJoCo's, and the steps to take.
const TASKS: [(&str, Option<&Robot>, u32); 6] = [
    ("inverted-double-pendulum", Some(&DOUBLE_PENDULUM), 20_000),
    ("hopper", Some(&HOPPER), 10_000),
    ("half-cheetah", Some(&HALF_CHEETAH), 20_000),
    ("cartpole", None, 1_000_000),
    ("acrobot", None, 500_000),
    ("pendulum", None, 1_000_000),
];

/// Prints the table.
pub fn print() {
    println!(
        "Tasks under random actions, one thread, resets and observations included; medians of {ROUNDS} rounds\n"
    );
    println!("| task | `mj_step` alone, steps/CPU-s | task, steps/CPU-s | ratio |");
    println!("|---|---|---|---|");
    for (name, robot, steps) in TASKS {
        let mut task = create(name).expect("a task of this project");
        let Some(robot) = robot else {
            let rates = (0..ROUNDS).map(|_| rate(steps.into(), play(&mut *task, steps)));
            println!("| {name} | – | {:.0} | – |", median(rates.collect()));
            continue;
        };
        let tape = Tape::default();
        play(&mut Recording::new(create(name).expect("it"), &tape), steps);
        let tape = std::mem::take(&mut *tape.lock().expect("no panic"));
        let rounds: Vec<[f64; 2]> = (0..ROUNDS)
            .map(|_| {
                let ours = replay::task(&mut *task, &tape);
                [replay::bare(robot, &tape), ours].map(|time| rate(steps.into(), time))
            })
            .collect();
        let middle = |of: fn(&[f64; 2]) -> f64| median(rounds.iter().map(of).collect());
        println!(
            "| {name} | {:.0} | {:.0} | {:.3} |",
            middle(|r| r[0]),
            middle(|r| r[1]),
            middle(|r| r[1] / r[0]),
        );
    }
    println!();
}

/// Takes this many steps under random actions, through as many episodes as that needs.
fn play(task: &mut dyn Task, steps: u32) -> Duration {
    let spec = task.spec();
    let (actions, limit, inputs) = (spec.actions, spec.max_steps, spec.inputs.len());
    let mut observation = vec![0.0; inputs];
    let mut rng = Rng::new(1);
    let mut left = 0;
    let started = ThreadTime::now();
    for _ in 0..steps {
        if left == 0 {
            task.reset(&mut rng);
            task.observe(&mut observation);
            left = limit;
        }
        // As many as the humanoids have outputs.
        let mut values = [0.0; 17];
        let action = match actions {
            ActionSpace::Discrete(count) => Action::Discrete(rng.below(count.into()) as u16),
            ActionSpace::Continuous { len, low, high } => {
                let values = &mut values[..usize::from(len)];
                let (low, high) = (f64::from(low), f64::from(high));
                values.fill_with(|| rng.uniform(low, high) as f32);
                Action::Continuous(values)
            }
        };
        let ended = task.step(action).terminated;
        task.observe(&mut observation);
        left = if ended { 0 } else { left - 1 };
    }
    started.elapsed()
}
