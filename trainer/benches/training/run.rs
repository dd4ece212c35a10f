//! A run of a preset as it is: cores busy, and the share of everything that is no episode.

use std::time::Instant;

use cpu_time::ProcessTime;
use tpg_trainer::session::Session;

use super::config;

const PRESET: &str = "hopper-sr-sm-b23";
/// The first one scores 1 500 new teams, the others 1 000.
const GENERATIONS: u64 = 3;

/// Prints a row for each generation, in wall-clock time.
pub fn print() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut session = Session::new(config(PRESET, &[]), 1).expect("a preset");
    let mut pool = session.pool(threads).expect("the task");
    println!("`{PRESET}` as it is, {threads} threads, wall-clock time\n");
    println!(
        "| generation | seconds | steps | CPU time / (wall x threads) | not left idle, % | lowering and loading, % of thread time | evolution, % of a generation |"
    );
    println!("|---|---|---|---|---|---|---|");
    for _ in 0..GENERATIONS {
        let (spent, overhead) = (pool.spent(), session.overhead().total());
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        let report = session.advance(&mut pool).expect("it can be scored");
        let (cpu, wall) = (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64());
        let now = pool.spent();
        let evolution = (session.overhead().total() - overhead).as_secs_f64();
        let prepared = (now.lowering - spent.lowering + now.loading - spent.loading).as_secs_f64();
        let idle = (now.idle - spent.idle).as_secs_f64() + evolution * (threads - 1) as f64;
        let capacity = wall * threads as f64;
        println!(
            "| {} | {wall:.2} | {} | {:.3} | {:.2} | {:.3} | {:.3} |",
            report.generation,
            report.steps,
            cpu / capacity,
            100.0 * (1.0 - idle / capacity),
            100.0 * prepared / capacity,
            100.0 * evolution / wall,
        );
    }
    println!();
}
