//! A whole training run on the fixture beside the same steps of MuJoCo alone.

use std::time::Duration;

use cpu_time::ProcessTime;
use tpg_tasks::eval::{Arena, Domain, episode_seed};
use tpg_tasks::task::{self, Wrappers};
use tpg_trainer::config::{Config, Settings};
use tpg_trainer::evolve::Population;
use tpg_trainer::pool::Pool;
use tpg_trainer::session::{LogMark, Session, Snapshot};

use super::fixture::{self, Size};
use super::replay::{self, HALF_CHEETAH, HOPPER, Recording, Robot, Tape};
use super::{config, median, rate};

const ROUNDS: usize = 5;
const GENERATIONS: u64 = 2;
const SEED: u64 = 1;

/// The shares of one run, in seconds of CPU time.
#[derive(Default)]
struct Round {
    whole: f64,
    bare: f64,
    environment: f64,
    lowering: f64,
    loading: f64,
    evolution: f64,
    checkpoint: f64,
}

impl Round {
    /// What is left when everything else is taken away.
    fn decisions(&self) -> f64 {
        let other = self.lowering + self.loading + self.evolution + self.checkpoint;
        self.whole - self.environment - other
    }
}

/// Prints both tables.
pub fn print() {
    println!(
        "Training on the fixture (teams of 10 programs x 30 effective instructions, {GENERATIONS} generations, one"
    );
    println!(
        "thread, checkpoint included) beside `mj_step` on the same states; medians of {ROUNDS} rounds\n"
    );
    println!(
        "| task | matrix products per team | steps | `mj_step` alone, steps/CPU-s | training, steps/CPU-s | ratio |"
    );
    println!("|---|---|---|---|---|---|");
    let mut shares = Vec::new();
    for (preset, robot, roots) in [
        ("hopper-sr-sm-b23", &HOPPER, 40),
        ("half-cheetah-sr-sm-b23", &HALF_CHEETAH, 3),
    ] {
        for products in [0, 1, 10] {
            let (steps, rounds) = measure(preset, robot, roots, products);
            let middle = |part: fn(&Round) -> f64| median(rounds.iter().map(part).collect());
            let per_second = |seconds: f64| rate(steps, Duration::from_secs_f64(seconds));
            println!(
                "| {preset} | {products} | {steps} | {:.0} | {:.0} | {:.3} |",
                per_second(middle(|r| r.bare)),
                per_second(middle(|r| r.whole)),
                middle(|r| r.bare / r.whole),
            );
            let share = |part: fn(&Round) -> f64| {
                let shares = rounds.iter().map(|r| 100.0 * part(r) / r.whole);
                format!("{:.2} |", median(shares.collect()))
            };
            shares.push(format!(
                "| {preset} | {products} | {} {} {} {} {} {} {}",
                share(|r| r.bare),
                share(|r| r.environment - r.bare),
                share(Round::decisions),
                share(|r| r.lowering),
                share(|r| r.loading),
                share(|r| r.evolution),
                share(|r| r.checkpoint),
            ));
        }
    }
    println!("\nWhere its time goes, in per cent\n");
    println!(
        "| task | products | `mj_step` | rest of the task, resets, masks | decisions | lowering | loading | evolution | one checkpoint |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    shares.iter().for_each(|row| println!("{row}"));
    println!();
}

fn measure(preset: &str, robot: &Robot, roots: usize, products: usize) -> (u64, Vec<Round>) {
    let config = config(
        preset,
        &[
            format!("evolution.population={roots}"),
            format!("evolution.children={roots}"),
        ],
    );
    let size = Size {
        roots,
        programs: 10,
        instructions: 30,
        products,
    };
    let population = fixture::population(&config, size, SEED);
    let settings = Settings::new(&config).expect("a sound configuration");
    let tape = Tape::default();
    let task = task::create(&config.task).expect("a task");
    let wrappers = Wrappers::new(&settings.observability, task.spec()).expect("they fit");
    let recording = Arena::new(Box::new(Recording::new(task, &tape)), wrappers);
    let (steps, _) = train(&config, &population, &mut Pool::new(vec![recording]));
    let tape = std::mem::take(&mut *tape.lock().expect("no panic"));
    let seeds: Vec<u64> = (0..GENERATIONS)
        .flat_map(|generation| {
            (0..u64::from(settings.episodes))
                .map(move |k| episode_seed(Domain::Train, SEED, generation, k))
        })
        .collect();
    let mut arena = settings.arena().expect("a task");
    let rounds = (0..ROUNDS).map(|_| {
        let mut pool = Pool::new(vec![settings.arena().expect("a task")]);
        let (again, mut round) = train(&config, &population, &mut pool);
        assert_eq!(again, steps, "not the run that was recorded");
        round.bare = replay::bare(robot, &tape).as_secs_f64();
        round.environment = replay::environment(&mut arena, &tape, &seeds).as_secs_f64();
        round
    });
    (steps, rounds.collect())
}

/// A run of a few generations as `tpg train` makes them, with its checkpoint at the end.
fn train(config: &Config, population: &Population, pool: &mut Pool) -> (u64, Round) {
    let population = population.clone();
    let mut session =
        Session::with_population(config.clone(), SEED, population).expect("a sound configuration");
    let path = std::env::temp_dir().join(format!("tpg-bench-{}", std::process::id()));
    let started = ProcessTime::now();
    for _ in 0..GENERATIONS {
        session.advance(pool).expect("it can be scored");
    }
    let trained = started.elapsed();
    Snapshot::new(&session)
        .save(&path, Vec::new(), LogMark::default())
        .expect("room on disk");
    let whole = started.elapsed();
    std::fs::remove_file(&path).expect("it was written");
    let spent = pool.spent();
    let round = Round {
        whole: whole.as_secs_f64(),
        lowering: spent.lowering.as_secs_f64(),
        loading: spent.loading.as_secs_f64(),
        evolution: session.overhead().total().as_secs_f64(),
        checkpoint: (whole - trained).as_secs_f64(),
        ..Round::default()
    };
    (session.steps(), round)
}
