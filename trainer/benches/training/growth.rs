//! How the cost of a generation grows, episodes apart: roots, programs and their length.

use std::process::Command;
use std::time::{Duration, Instant};

use tpg_runtime::Action;
use tpg_tasks::eval::Arena;
use tpg_tasks::task::{Rng, Spec, Step, Task, Terms, Wrappers, create};
use tpg_trainer::config::Settings;
use tpg_trainer::pool::Pool;
use tpg_trainer::session::{LogMark, Session, Snapshot};

use super::config;
use super::fixture::{self, Size};

/// First argument of the process that measures one row: peak memory is a property of a process.
pub const POINT: &str = "growth-point";
const PRESET: &str = "hopper-sr-sm-b23";
const GENERATIONS: u32 = 3;

/// Roots, programs of a team, instructions of a program.
const POINTS: [[usize; 3]; 11] = [
    [500, 10, 30],
    [1_500, 10, 30],
    [3_000, 10, 30],
    [5_000, 10, 30],
    [10_000, 10, 30],
    [1_500, 2, 30],
    [1_500, 5, 30],
    [1_500, 10, 10],
    [1_500, 10, 60],
    [1_500, 10, 90],
    [10_000, 3, 10],
];

/// Prints the curve.
pub fn print() {
    println!(
        "A generation of `{PRESET}` on the fixture without its episodes, one thread, milliseconds (two thirds as many"
    );
    println!(
        "children as roots; mean of {GENERATIONS} generations), and the peak memory of its process\n"
    );
    println!(
        "| roots | programs | instructions | variation | lowering | loading | selection | report | all | µs per child | checkpoint | peak MiB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for point in POINTS {
        let this = std::env::current_exe().expect("this program");
        let args = point.map(|n| n.to_string());
        let status = Command::new(this).arg(POINT).args(args).status();
        assert!(status.is_ok_and(|s| s.success()), "a point failed");
    }
    println!();
}

/// Measures one row in this process and prints it.
pub fn point(args: &[String]) {
    let numbers: Vec<usize> = args.iter().filter_map(|a| a.parse().ok()).collect();
    let [roots, programs, instructions] = numbers[..] else {
        panic!("roots, programs, instructions");
    };
    let children = roots * 2 / 3;
    let config = config(
        PRESET,
        &[
            format!("evolution.population={roots}"),
            format!("evolution.children={children}"),
            "evaluation.episodes=1".into(),
        ],
    );
    let size = Size {
        roots,
        programs,
        instructions,
        products: programs,
    };
    let population = fixture::population(&config, size, 1);
    let settings = Settings::new(&config).expect("a sound configuration");
    let task = OneStep {
        spec: create(&config.task).expect("a task").spec().clone(),
        rng: Rng::new(1),
    };
    let wrappers = Wrappers::new(&settings.observability, task.spec()).expect("they fit");
    let mut pool = Pool::new(vec![Arena::new(Box::new(task), wrappers)]);
    let mut session = Session::with_population(config, 1, population).expect("sound");
    session.advance(&mut pool).expect("it can be scored");
    let (spent, overhead) = (pool.spent(), *session.overhead());
    for _ in 0..GENERATIONS {
        session.advance(&mut pool).expect("it can be scored");
    }
    let (now, later) = (pool.spent(), *session.overhead());
    let parts = [
        later.variation - overhead.variation,
        now.lowering - spent.lowering,
        now.loading - spent.loading,
        later.selection - overhead.selection,
        later.report - overhead.report,
    ];
    let started = Instant::now();
    let path = std::env::temp_dir().join(format!("tpg-bench-{}", std::process::id()));
    Snapshot::new(&session)
        .save(&path, Vec::new(), LogMark::default())
        .expect("room on disk");
    let checkpoint = started.elapsed();
    std::fs::remove_file(&path).expect("it was written");
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3 / f64::from(GENERATIONS);
    let all = milliseconds(parts.iter().sum());
    print!("| {roots} | {programs} | {instructions} |");
    for part in parts {
        print!(" {:.2} |", milliseconds(part));
    }
    println!(
        " {all:.1} | {:.1} | {:.0} | {} |",
        all * 1e3 / children as f64,
        checkpoint.as_secs_f64() * 1e3,
        peak_mebibytes().map_or_else(|| "not known here".into(), |m| format!("{m:.0}")),
    );
}

/// The largest resident memory that this process has had, where Linux tells.
fn peak_mebibytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// A plant that ends every episode with its first step and a random reward: what is left is evolution.
struct OneStep {
    spec: Spec,
    rng: Rng,
}

impl Task for OneStep {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn reset(&mut self, _: &mut Rng) {}

    fn observe(&self, observation: &mut [f32]) {
        observation.fill(0.5);
    }

    fn step(&mut self, _: Action<'_>) -> Step {
        Step {
            reward: self.rng.uniform(0.0, 1.0),
            terms: Terms::default(),
            terminated: true,
            unstable: false,
        }
    }
}
