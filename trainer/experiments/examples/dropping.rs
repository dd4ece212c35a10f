//! What `evaluation.drop-after` spares and what it costs: one run, scored in full, in which dropping is simulated.
//!
//! `cargo run --release -p tpg-experiments --example dropping -- [GENERATIONS [PRESET...]]`
//!
//! For each rule the table has the share of training steps that it spares, and the share of survivors that it would have
//! dropped: those that all their episodes brought into the population.

use std::sync::Arc;

use tpg_tasks::eval::Episode;
use tpg_tasks::stats::{mean, standard_deviation};
use tpg_trainer::config::{Preset, resolve};
use tpg_trainer::evaluator::{Alone, AloneScore, Batch, Evaluator, EvaluatorError};
use tpg_trainer::front_end::Recording;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::pool::Pool;
use tpg_trainer::session::Session;

const PRESETS: [&str; 4] = [
    "cartpole-sr",
    "pendulum-sr",
    "hopper-sr-b23",
    "half-cheetah-sr-b23",
];
const EPISODES: usize = 10;
const POPULATION: usize = 100;
/// Episodes that everyone plays, and standard errors by which one must lie behind.
const RULES: [(usize, f64); 9] = [
    (2, 0.0),
    (2, 1.0),
    (2, 2.0),
    (3, 0.0),
    (3, 1.0),
    (3, 2.0),
    (5, 0.0),
    (5, 1.0),
    (5, 2.0),
];

/// Keeps the episodes of all policies.
struct Keeping {
    pool: Pool,
    batches: Vec<Vec<Vec<Episode>>>,
}

impl Evaluator for Keeping {
    fn monitor(&self) -> &Arc<Monitor> {
        self.pool.monitor()
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        let scored = self.pool.score(batch)?;
        self.batches
            .push(scored.iter().flatten().cloned().collect());
        Ok(scored)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        self.pool.score_alone(alone)
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        self.pool.take_recordings()
    }
}

/// What a rule came to.
#[derive(Default)]
struct Tally {
    steps: u64,
    spared: u64,
    survivors: u64,
    lost: u64,
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let generations = arguments.next().map_or(Ok(20), |text| text.parse())?;
    let named: Vec<String> = arguments.collect();
    let presets = match named.as_slice() {
        [] => PRESETS.map(str::to_owned).to_vec(),
        _ => named,
    };
    println!(
        "| preset | episodes first | standard errors | steps spared | survivors lost |\n|---|---|---|---|---|"
    );
    for preset in presets {
        let batches = train(&preset, generations)?;
        for (first, errors) in RULES {
            let tally = simulate(&batches, first, errors);
            println!(
                "| {preset} | {first} of {EPISODES} | {errors} | {:.1} % | {:.1} % |",
                100.0 * tally.spared as f64 / tally.steps as f64,
                100.0 * tally.lost as f64 / tally.survivors.max(1) as f64
            );
        }
    }
    Ok(())
}

fn train(preset: &str, generations: u32) -> anyhow::Result<Vec<Vec<Vec<Episode>>>> {
    let preset = Preset::find(preset)?;
    let settings = [
        format!("evaluation.episodes={EPISODES}"),
        format!("evolution.population={POPULATION}"),
        format!("evolution.children={POPULATION}"),
    ];
    let mut session = Session::new(resolve(&preset, None, &settings)?, 1)?;
    let mut keeping = Keeping {
        pool: session.pool(std::thread::available_parallelism()?.get())?,
        batches: Vec::new(),
    };
    for _ in 0..generations {
        session.advance(&mut keeping)?;
    }
    Ok(keeping.batches)
}

fn returns(episodes: &[Episode]) -> Vec<f64> {
    episodes.iter().map(|e| e.shaped).collect()
}

/// Selects as a session does: the best of old and new, by means over all episodes.
fn simulate(batches: &[Vec<Vec<Episode>>], first: usize, errors: f64) -> Tally {
    let mut tally = Tally::default();
    let mut survivors: Vec<f64> = Vec::new();
    for batch in batches {
        let last = |means: &mut dyn Iterator<Item = f64>| {
            let mut all: Vec<f64> = survivors.iter().copied().chain(means).collect();
            all.sort_by(|a, b| b.total_cmp(a));
            all.truncate(POPULATION);
            all
        };
        let so_far = last(&mut batch.iter().map(|e| mean(&returns(&e[..first]))));
        let after = last(&mut batch.iter().map(|e| mean(&returns(e))));
        let is_full = survivors.len() + batch.len() > POPULATION;
        for episodes in batch {
            let played = returns(&episodes[..first]);
            let error = standard_deviation(&played) / (first as f64).sqrt();
            let dropped = is_full && mean(&played) + errors * error < so_far[POPULATION - 1];
            let survives = mean(&returns(episodes)) >= after[after.len() - 1];
            let steps = |e: &[Episode]| e.iter().map(|e| u64::from(e.steps)).sum::<u64>();
            tally.steps += steps(episodes);
            tally.spared += if dropped {
                steps(&episodes[first..])
            } else {
                0
            };
            if is_full {
                tally.survivors += u64::from(survives);
                tally.lost += u64::from(survives && dropped);
            }
        }
        survivors = after;
    }
    tally
}
