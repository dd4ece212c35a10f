//! What instructions and decisions cost, interpreted and compiled, in CPU time beside a calibrating loop of the process.
//!
//! `cargo bench -p tpg-tests --bench interpreter [FILTER]` ends with a table of medians.

#[path = "compiled/arithmetic.rs"]
#[rustfmt::skip]
mod arithmetic;
#[path = "compiled/transcendental.rs"]
#[rustfmt::skip]
mod transcendental;

use std::fs;
use std::hint::black_box;
use std::ops::RangeInclusive;
use std::time::Duration;

use cpu_time::ThreadTime;
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{BenchmarkId, Criterion, Throughput};
use tpg_runtime::isa::Op;
use tpg_runtime::{Agent, Fixed, HostAgent, Policy, State};
use tpg_tests::shapes::{
    ARITHMETIC, LONG, SHORT, TRANSCENDENTAL, drifting_observations, straight, typical_graph,
};

/// CPU time of the measuring thread: other processes on the machine disturb it less than wall time.
struct CpuTime;

impl Measurement for CpuTime {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        ThreadTime::now().as_duration()
    }

    fn end(&self, start: Duration) -> Duration {
        self.start() - start
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// A row of the final table: what ran, and how many units of work one iteration holds.
struct Row {
    group: &'static str,
    name: String,
    units: f64,
}

struct Bench {
    criterion: Criterion<CpuTime>,
    rows: Vec<Row>,
}

impl Bench {
    fn run(&mut self, group: &'static str, name: &str, units: f64, mut iteration: impl FnMut()) {
        let mut measured = self.criterion.benchmark_group(group);
        measured.throughput(Throughput::Elements(units.round() as u64));
        measured.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(&mut iteration);
        });
        measured.finish();
        self.rows.push(Row {
            group,
            name: name.to_owned(),
            units,
        });
    }

    /// One program of many instructions of a class, in the agent of hosts and in one as firmware has; the unit is one instruction.
    fn class<const W: usize>(&mut self, name: &str, mix: &[Op], len: usize) {
        let bytes = straight(mix, W as u16, len).encode();
        let policy = Policy::load(&bytes).expect("a well-formed policy");
        let observation = [0.5; W];
        let name = format!("{name} W={W}");
        let mut agent: Box<HostAgent<'_>> = Box::new(Agent::new(policy).expect("room"));
        self.run("host", &name, len as f64, || {
            black_box(agent.decide(black_box(&observation)).is_ok());
        });
        let mut agent: Box<Agent<'_, Fixed<W>, State<4096, 4, 4, 4>>> =
            Box::new(Agent::new(policy).expect("room"));
        self.run("firmware", &name, len as f64, || {
            black_box(agent.decide(black_box(&observation)).is_ok());
        });
    }

    /// Decisions of a graph over a drifting observation; the unit is one decision.
    fn graph(
        &mut self,
        name: &str,
        mix: &[Op],
        teams: u16,
        lengths: &RangeInclusive<u64>,
        stateful: bool,
    ) {
        let observations = drifting_observations();
        let (bytes, mean) = typical_graph(mix, teams, lengths, stateful, &observations);
        let policy = Policy::load(&bytes).expect("a well-formed policy");
        let mut agent: Box<HostAgent<'_>> = Box::new(Agent::new(policy).expect("room"));
        let mut all = observations.iter().cycle();
        let name = format!("{name}, {teams} teams, {mean:.0} instructions");
        self.run("decision", &name, 1.0, || {
            let observation = all.next().expect("it cycles");
            black_box(agent.decide(black_box(observation)).is_ok());
        });
    }
}

fn classes<const W: usize>(bench: &mut Bench) {
    use Op::*;
    bench.class::<W>("scalar arithmetic", ARITHMETIC, 600);
    bench.class::<W>("add", &[Add], 600);
    bench.class::<W>("vector arithmetic", &[VAdd, VSub, VMul, VMin, VMax], 200);
    bench.class::<W>("vector division", &[VDiv], 200);
    bench.class::<W>("inner product", &[Dot], 200);
    bench.class::<W>("matrix arithmetic", &[MAdd, MSub, MMul, MMin, MMax], 100);
    bench.class::<W>("matrix x vector", &[MatVec], 100);
    bench.class::<W>("matrix x matrix", &[MatMul], 50);
    bench.class::<W>("transpose", &[Transpose], 100);
    bench.class::<W>("outer product", &[Outer], 100);
    bench.class::<W>("row standard deviation", &[RowStd], 100);
    bench.class::<W>("column norm", &[ColumnNorm], 100);
}

fn main() {
    let mut bench = Bench {
        criterion: Criterion::default()
            .with_measurement(CpuTime)
            .warm_up_time(Duration::from_millis(200))
            .measurement_time(Duration::from_millis(600))
            .configure_from_args(),
        rows: Vec::new(),
    };
    bench.run("calibration", "1000 dependent additions", 1000.0, || {
        let mut sum = black_box(0.0f32);
        let step = black_box(0.25f32);
        for _ in 0..1000 {
            sum += step;
        }
        black_box(sum);
    });
    classes::<11>(&mut bench);
    classes::<17>(&mut bench);
    for (name, mix) in [
        ("arithmetic", ARITHMETIC),
        ("3 in 8 transcendental", TRANSCENDENTAL),
    ] {
        bench.graph(&format!("stateless {name}"), mix, 9, &LONG, false);
        bench.graph(&format!("stateful {name}"), mix, 9, &LONG, true);
    }
    macro_rules! compiled {
        ($module:ident) => {
            let observations = drifting_observations();
            let (mut all, mut policy) = (observations.iter().cycle(), $module::Policy::new());
            let name = concat!("stateless ", stringify!($module), ", 9 teams");
            bench.run("compiled", name, 1.0, || {
                let observation = all.next().expect("it cycles");
                black_box(policy.decide(black_box(observation)).action);
            });
        };
    }
    compiled!(arithmetic);
    compiled!(transcendental);
    for teams in [1, 3, 27, 50] {
        bench.graph("stateless arithmetic", ARITHMETIC, teams, &LONG, false);
    }
    let short = "stateless short programs";
    bench.graph(short, TRANSCENDENTAL, 9, &SHORT, false);
    bench.criterion.final_summary();
    table(&bench.rows);
}

/// Prints the medians that criterion has just stored, for the rows that ran.
fn table(rows: &[Row]) {
    let mut calibration = f64::NAN;
    println!("| what | median ns | of one dependent addition |\n|---|---|---|");
    for row in rows {
        let folder = format!("{}/{}", row.group, row.name.replace('/', "_"));
        let Some(median) = stored_median(&folder) else {
            continue;
        };
        let each = median / row.units;
        if row.group == "calibration" {
            calibration = each;
        }
        println!(
            "| {}: {} | {each:.2} | x{:.2} |",
            row.group,
            row.name,
            each / calibration
        );
    }
}

fn stored_median(folder: &str) -> Option<f64> {
    let target = std::env::var("CARGO_TARGET_DIR").unwrap_or_else(|_| "target".into());
    let root = [target.clone(), format!("../{target}")];
    let text = root.iter().find_map(|root| {
        fs::read_to_string(format!("{root}/criterion/{folder}/new/estimates.json")).ok()
    })?;
    let estimates: serde_json::Value = serde_json::from_str(&text).ok()?;
    estimates.get("median")?.get("point_estimate")?.as_f64()
}
