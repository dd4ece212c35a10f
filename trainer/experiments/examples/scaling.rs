//! How far training scales over the ranks of an MPI job: measured episodes, simulated ranks.
//!
//! `cargo run --release -p tpg-experiments --example scaling -- [PRESET [GENERATIONS [FIGURE.svg]]]`
//!
//! One thread trains a few generations and measures what each policy costs: its bytes, making them, and its episodes. The
//! ranks are simulated from that, with the packs that rank 0 of a job makes and with costs of messages. Standard output is
//! a table of parallel efficiency, and of what limits it.

use std::sync::Arc;
use std::time::Instant;

use plotters::prelude::*;
use plotters::style::register_font;
use tpg_tasks::eval::Episode;
use tpg_trainer::config::{Preset, resolve};
use tpg_trainer::evaluator::{
    Alone, AloneScore, Batch, Evaluator, EvaluatorError, Packs, Split, job_seeds, jobs,
};
use tpg_trainer::front_end::Recording;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::pool::Pool;
use tpg_trainer::session::Session;

/// Seconds that a message costs each side, and seconds a byte: OpenMPI between two ranks of one machine took 2 to 23 µs.
const MESSAGE: f64 = 20e-6;
const BYTE: f64 = 1e-9;
/// Packs that a rank has at a time, and the number of ranks from which rank 0 runs no episodes, as in `cluster::Head`.
const AHEAD: usize = 2;
const SCORING_HEAD: usize = 16;
const RANKS: [usize; 11] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000];

/// What a policy of a batch costs.
struct Cost {
    lowering: f64,
    bytes: f64,
    /// Seconds of each episode.
    episodes: Vec<f64>,
}

/// A batch that was measured.
struct Measured {
    expected: Vec<f64>,
    split: Split,
    costs: Vec<Cost>,
}

/// Scores with one thread, policy by policy and episode by episode, and keeps the times.
struct Stopwatch {
    pool: Pool,
    batches: Vec<Measured>,
}

impl Stopwatch {
    fn episodes(
        &mut self,
        batch: &Batch<'_>,
        blob: &[u8],
        seeds: &[u64],
    ) -> Result<(Option<Vec<Episode>>, Vec<f64>), EvaluatorError> {
        let pieces: Vec<&[u64]> = match batch.split {
            Split::Episodes => seeds.chunks(1).collect(),
            Split::Agents => vec![seeds],
        };
        let (mut all, mut times) = (Some(Vec::new()), Vec::new());
        for seeds in pieces {
            let started = Instant::now();
            let one = Batch {
                expected: &[1.0],
                make: &|_| Some(blob.to_vec()),
                episodes: seeds.len(),
                episode_seeds: seeds,
                split: Split::Agents,
                conditions: batch.conditions,
                record: batch.record,
            };
            let scored = self.pool.score(&one)?.pop().flatten();
            let seconds = started.elapsed().as_secs_f64() / seeds.len() as f64;
            times.extend(std::iter::repeat_n(seconds, seeds.len()));
            match (&mut all, scored) {
                (Some(all), Some(more)) => all.extend(more),
                (all, _) => *all = None,
            }
        }
        Ok((all, times))
    }
}

impl Evaluator for Stopwatch {
    fn monitor(&self) -> &Arc<Monitor> {
        self.pool.monitor()
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        let (mut scored, mut costs) = (Vec::new(), Vec::new());
        for (policy, whole) in jobs(
            &vec![1.0; batch.expected.len()],
            batch.episodes,
            Split::Agents,
            1,
        )
        .iter()
        .enumerate()
        {
            let started = Instant::now();
            let blob = (batch.make)(policy);
            let lowering = started.elapsed().as_secs_f64();
            let seeds = job_seeds(whole, batch.episode_seeds, batch.episodes).to_vec();
            let (episodes, times) = match &blob {
                Some(blob) => self.episodes(batch, blob, &seeds)?,
                None => (None, vec![0.0; batch.episodes]),
            };
            scored.push(episodes);
            costs.push(Cost {
                lowering,
                bytes: blob.map_or(0, |blob| blob.len()) as f64,
                episodes: times,
            });
        }
        self.batches.push(Measured {
            expected: batch.expected.to_vec(),
            split: batch.split,
            costs,
        });
        Ok(scored)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        self.pool.score_alone(alone)
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        self.pool.take_recordings()
    }
}

/// How long a batch takes, and how long rank 0 is busy with it.
fn simulate(batch: &Measured, ranks: usize) -> (f64, f64) {
    let episodes = batch.costs.first().map_or(1, |cost| cost.episodes.len());
    let head_scores = ranks <= SCORING_HEAD;
    let workers = ranks - usize::from(!head_scores);
    let mut packs = Packs::new(&batch.expected, episodes, batch.split, workers);
    let seconds = |job: &tpg_trainer::evaluator::Job| -> f64 {
        let cost = &batch.costs[job.policy];
        cost.episodes[job.first_episode..][..job.episodes]
            .iter()
            .sum()
    };
    let mut lowered = vec![false; batch.costs.len()];
    // When rank 0 is free, when each other rank has done what it has, and when it needs the next pack.
    let (mut head, mut busy) = (0.0_f64, 0.0_f64);
    let mut ends: Vec<Vec<f64>> = vec![Vec::new(); ranks];
    let mut last = 0.0_f64;
    while !packs.is_empty() {
        // The rank that has room first; rank 0 where it scores and no other has room by then.
        let room = |rank: &usize| -> f64 {
            let ends = &ends[*rank];
            match ends.len() < AHEAD {
                true => 0.0,
                false => ends[ends.len() - AHEAD],
            }
        };
        let next = (1..ranks).min_by(|a, b| room(a).total_cmp(&room(b)));
        let waits = next.map_or(f64::INFINITY, |rank| room(&rank));
        let mut spend = |seconds: f64, head: &mut f64| {
            busy += seconds;
            *head += seconds;
        };
        if head_scores && waits > head {
            let Some(job) = packs.one() else { break };
            if !std::mem::replace(&mut lowered[job.policy], true) {
                spend(batch.costs[job.policy].lowering, &mut head);
            }
            spend(seconds(&job), &mut head);
            last = last.max(head);
            continue;
        }
        let Some(rank) = next else { break };
        head = head.max(waits);
        let (mut work, mut bytes) = (0.0, 0.0);
        for job in packs.pack() {
            let cost = &batch.costs[job.policy];
            if !std::mem::replace(&mut lowered[job.policy], true) {
                spend(cost.lowering, &mut head);
            }
            work += seconds(&job);
            bytes += cost.bytes;
        }
        // Sending the pack, and receiving its answer some time.
        spend(2.0 * MESSAGE + bytes * BYTE, &mut head);
        let starts = ends[rank]
            .last()
            .copied()
            .unwrap_or(0.0)
            .max(head + MESSAGE);
        let end = starts + work + 2.0 * MESSAGE + bytes * BYTE;
        ends[rank].push(end);
        last = last.max(end);
    }
    (last.max(head), busy)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let preset = arguments
        .next()
        .unwrap_or_else(|| "hopper-sr-sm-b23".into());
    let generations: u32 = arguments.next().map_or(Ok(3), |text| text.parse())?;
    let figure = arguments.next();
    let config = resolve(&Preset::find(&preset)?, None, &[])?;
    let mut session = Session::new(config, 1)?;
    let mut stopwatch = Stopwatch {
        pool: session.pool(1)?,
        batches: Vec::new(),
    };
    for _ in 0..generations {
        session.advance(&mut stopwatch)?;
    }
    let batches = stopwatch.batches;
    let serial = session.overhead().total().as_secs_f64();
    let sum = |of: fn(&Cost) -> f64| -> f64 {
        batches.iter().flat_map(|batch| &batch.costs).map(of).sum()
    };
    let (lowering, episodes) = (
        sum(|cost| cost.lowering),
        sum(|cost| cost.episodes.iter().sum()),
    );
    let longest = batches
        .iter()
        .flat_map(|batch| &batch.costs)
        .flat_map(|cost| &cost.episodes)
        .copied()
        .fold(0.0, f64::max);
    let policies: usize = batches.iter().map(|batch| batch.costs.len()).sum();
    let one = serial + lowering + episodes;
    println!("{preset}: {generations} generations, {policies} policies, {one:.1} s on one core:");
    println!(
        "episodes {episodes:.2} s, making policies {lowering:.3} s, variation, selection and report {serial:.3} s, \
         longest episode {:.1} ms\n",
        1e3 * longest
    );
    println!("| ranks | seconds | efficiency | rank 0 busy |");
    println!("|---|---|---|---|");
    let mut points = Vec::new();
    for ranks in RANKS {
        let (mut all, mut busy) = (serial, serial);
        for batch in &batches {
            let (seconds, head) = simulate(batch, ranks);
            all += seconds;
            busy += head;
        }
        let efficiency = one / (all * ranks as f64);
        println!(
            "| {ranks} | {all:.3} | {:.0} % | {:.0} % |",
            100.0 * efficiency,
            100.0 * busy / all
        );
        points.push((ranks as f64, 100.0 * efficiency));
    }
    if let Some(path) = figure {
        draw(&path, &preset, &points)?;
    }
    Ok(())
}

fn draw(path: &str, preset: &str, points: &[(f64, f64)]) -> Result<(), Box<dyn std::error::Error>> {
    if register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular()).is_err() {
        return Err("the font of this program is none".into());
    }
    let root = SVGBackend::new(path, (640, 400)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("Simulated ranks: {preset}"), ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(50)
        .build_cartesian_2d((1.0..1000.0).log_scale(), 0.0..105.0)?;
    chart
        .configure_mesh()
        .x_desc("ranks")
        .y_desc("parallel efficiency, %")
        .draw()?;
    chart.draw_series(LineSeries::new(points.iter().copied(), &BLUE))?;
    chart.draw_series(
        points
            .iter()
            .map(|point| Circle::new(*point, 3, BLUE.filled())),
    )?;
    root.present()?;
    Ok(())
}
