//! What is drawn has the distributions that the documents state: memory writes, blackouts. Pearson's χ² against the formulas,
//! which are computed here by other means. Seeds are fixed, so a test passes always or never.

use tpg_runtime::blob::{MemoryModel, WriteDistribution};
use tpg_runtime::isa::Op;
use tpg_runtime::tables::Target;
use tpg_runtime::trace::{MemoryAddress, Observer};
use tpg_runtime::{Policy, Reset};
use tpg_tasks::task::{MISSING, Observability, Rng, Wrappers, create};
use tpg_tests::draft::{
    Draft, DraftProgram, DraftTeam, TestAgent, header, instruction, make_stateful,
};

const DECISIONS: u32 = 20_000;

/// Counts writes to each place.
struct Writes(Vec<u32>);

impl Observer for Writes {
    fn write(&mut self, address: MemoryAddress) {
        let place = match address {
            MemoryAddress::Slot(_, slot) => slot,
            MemoryAddress::Cell(cell) => cell,
            _ => return,
        };
        self.0[usize::from(place)] += 1;
    }
}

/// Pearson's statistic of counts against expected ones.
fn chi_squared(counts: &[u32], expected: &[f64]) -> f64 {
    assert_eq!(counts.len(), expected.len());
    let terms = counts.iter().zip(expected);
    terms
        .map(|(count, expected)| (f64::from(*count) - expected).powi(2) / expected)
        .sum()
}

/// The value that χ² of so many degrees of freedom exceeds once in a thousand times (Wilson and Hilferty).
fn limit(degrees: usize) -> f64 {
    let n = degrees as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + 3.090_232 * part.sqrt()).powi(3)
}

/// The integral of a function by Simpson's rule.
fn integral(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const HALVES: u32 = 2_000;
    let step = (high - low) / f64::from(2 * HALVES);
    let at = |k: u32| f(low + step * f64::from(k));
    let inner: f64 = (0..HALVES)
        .map(|k| at(2 * k) + 4.0 * at(2 * k + 1) + at(2 * k + 2))
        .sum();
    inner * step / 3.0
}

/// A policy of one program, with a memory of the given kind.
fn draft(memory: MemoryModel, distribution: WriteDistribution) -> Draft {
    let mut draft = Draft {
        header: header(1, 1),
        teams: vec![DraftTeam {
            members: vec![0],
            ..DraftTeam::default()
        }],
        programs: vec![DraftProgram::bidding(1.0, Target::Atomic(0))],
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    make_stateful(&mut draft.header, memory);
    draft.header.write_distribution = distribution;
    draft
}

/// How often each of `places` places is written, and how many writes there were.
fn writes(draft: &Draft, places: usize) -> Vec<u32> {
    let file = draft.encode();
    let policy = Policy::load(&file).expect("valid");
    let mut agent = Box::new(TestAgent::new(policy).expect("enough room"));
    agent.reset(Reset::Agent, 12);
    let mut writes = Writes(vec![0; places]);
    for _ in 0..DECISIONS {
        agent
            .decide_traced(&[0.0], &mut writes)
            .expect("its length");
    }
    writes.0
}

/// The share of writes of each slot: x is drawn around 4, its whole part clamped to 0…7.
fn slot_shares(density: impl Fn(f64) -> f64) -> Vec<f64> {
    let bounds = |slot: u32| {
        let low = if slot == 0 { -400.0 } else { f64::from(slot) };
        let high = if slot == 7 {
            408.0
        } else {
            f64::from(slot + 1)
        };
        (low, high)
    };
    let shares: Vec<f64> = (0..8)
        .map(|slot| {
            let (low, high) = bounds(slot);
            integral(low, high, &density)
        })
        .collect();
    let whole: f64 = shares.iter().sum();
    assert!((whole - 1.0).abs() < 0.01, "{whole}");
    shares.iter().map(|share| share / whole).collect()
}

#[test]
fn team_memory_is_written_where_the_distribution_says() {
    const SPREAD: f64 = 4.0 / 3.0;
    let normal = |x: f64| {
        let z = (x - 4.0) / SPREAD;
        (-0.5 * z * z).exp() / (SPREAD * (2.0 * std::f64::consts::PI).sqrt())
    };
    for (distribution, shares) in [
        (WriteDistribution::Thesis, slot_shares(normal)),
        (WriteDistribution::Uniform, vec![0.125; 8]),
    ] {
        let mut draft = draft(MemoryModel::Team, distribution);
        draft.teams[0].slots = [0xff, 0, 0];
        draft.teams[0].constants = vec![0.0; 8];
        let scalar = draft.scalar(0, 1);
        // Slots that are read are kept, and what is kept is counted.
        let reads = (0..8).map(|slot| instruction(Op::ReadS, scalar, slot, 0));
        let write = instruction(Op::WriteS, 0, scalar, 0);
        draft.programs[0].code = reads.chain([write]).collect();
        let counts = writes(&draft, 8);
        assert_eq!(counts.iter().sum::<u32>(), DECISIONS);
        let expected: Vec<f64> = shares
            .iter()
            .map(|share| share * f64::from(DECISIONS))
            .collect();
        let found = chi_squared(&counts, &expected);
        println!(
            "{distribution:?}: χ² {found:.1} of 7, limit {:.1}",
            limit(7)
        );
        assert!(
            found < limit(7),
            "{distribution:?}: {counts:?}, {expected:?}"
        );
    }
}

#[test]
fn indexed_memory_is_written_where_the_formula_says() {
    const ROWS: usize = 100;
    let mut draft = draft(MemoryModel::Indexed, WriteDistribution::Thesis);
    // One column of each row.
    draft.cells = (0..ROWS as u16).map(|row| 8 * row + 3).collect();
    draft.programs[0].registers = [8, 0, 0];
    draft.programs[0].constants = vec![0.0; 8];
    draft.programs[0].constants[0] = 1.0;
    let scalar = draft.scalar(0, 1);
    let first = u16::try_from(draft.memory_start()).expect("a small state");
    let reads = (0..ROWS as u16).map(|row| instruction(Op::MemRead, scalar, first + row, 0));
    draft.programs[0].code = reads.chain([instruction(Op::MemWrite, 0, 0, 0)]).collect();
    let counts: Vec<u32> = writes(&draft, 8 * ROWS)
        .into_iter()
        .skip(3)
        .step_by(8)
        .collect();
    // Each cell is written or not, so its variance is smaller than its mean: χ² of both outcomes.
    let found: f64 = counts
        .iter()
        .enumerate()
        .map(|(row, count)| {
            let i = if row < 50 { 49 - row } else { row - 50 } as f64;
            let p = 0.25 / (0.5 * std::f64::consts::PI * (i * i + 0.25));
            let n = f64::from(DECISIONS);
            (f64::from(*count) - n * p).powi(2) / (n * p * (1.0 - p))
        })
        .sum();
    println!("cells: χ² {found:.1} of {ROWS}, limit {:.1}", limit(ROWS));
    assert!(found < limit(ROWS), "{counts:?}");
}

#[test]
fn blackouts_hide_the_share_of_steps_that_they_name() {
    let task = create("cartpole").expect("a task");
    for (numerator, denominator) in [(1, 3), (2, 3), (1, 50)] {
        let blackout = Observability::Blackout {
            numerator,
            denominator,
        };
        let mut wrappers = Wrappers::new(&[blackout], task.spec()).expect("a probability");
        let (mut rng, mut out) = (Rng::new(3), [0.0; 4]);
        let mut hidden = [0, 0];
        for _ in 0..DECISIONS {
            wrappers.apply(&[0.5; 4], &mut out, &mut rng);
            let blank = out.iter().all(|value| value.to_bits() == MISSING.to_bits());
            hidden[usize::from(blank)] += 1;
        }
        let p = f64::from(numerator) / f64::from(denominator);
        let expected = [1.0 - p, p].map(|share| share * f64::from(DECISIONS));
        let found = chi_squared(&hidden, &expected);
        println!(
            "blackout:{numerator}/{denominator}: χ² {found:.1} of 1, limit {:.1}",
            limit(1)
        );
        assert!(found < limit(1), "{hidden:?}, {expected:?}");
    }
}
