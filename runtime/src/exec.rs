//! One decision: walk the teams, run their programs. Bounded, cannot panic.
//!
//! Every offset was checked by [`crate::verify`]; accesses go through `get`, so that even a policy
//! built by a faulty verifier could only compute a wrong number.

use rand_core::Rng as _;

use crate::blob::{InitialValues, RegisterMode};
use crate::isa::{Op, REGISTERS};
use crate::math::{self, classic};
use crate::memory::{IndexedStream, slot_of};
use crate::rng::Pcg32;
use crate::tables::{Instruction, Program, ProgramId, Section, Target, Team, TeamId};
use crate::verify::Policy;

/// The changing state of an agent, wherever it is kept.
pub struct Machine<'s> {
    pub words: &'s mut [f32],
    /// Bid of every program that ran in this decision, else NaN, which no bid ever is.
    pub bids: &'s mut [f32],
    pub visited: &'s mut [bool],
    pub streams: &'s mut [Pcg32],
    pub indexed: &'s mut IndexedStream,
}

/// How a decision came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path {
    /// The program that won at the last team.
    pub winner: ProgramId,
    /// Instructions executed.
    pub instructions: u32,
    /// Teams visited.
    pub teams: u16,
}

/// Runs one decision for a policy of vector width `W`; the observation lies in the window already.
pub(crate) fn decide<const W: usize>(policy: &Policy<'_>, machine: &mut Machine<'_>) -> Path {
    machine.bids.fill(f32::NAN);
    machine.visited.fill(false);
    let mut path = Path {
        winner: ProgramId(0),
        instructions: 0,
        teams: 0,
    };
    let mut team_id = TeamId(0);
    // A team is visited at most once: its programs that lead to visited teams take no part.
    for _ in 0..policy.header.teams {
        let Some(team) = policy.tables.team(team_id) else {
            break;
        };
        if let Some(seen) = machine.visited.get_mut(usize::from(team_id.0)) {
            *seen = true;
        }
        path.teams += 1;
        let mut best: Option<(f32, ProgramId, Target)> = None;
        for program_id in policy.tables.members(&team) {
            let Some(program) = policy.tables.program(program_id) else {
                continue;
            };
            if let Target::Team(TeamId(next)) = program.target
                && machine.visited.get(usize::from(next)).is_none_or(|v| *v)
            {
                continue;
            }
            let bid = bid::<W>(policy, machine, &team, program_id, &program, &mut path);
            // Only a higher bid takes over: of equals the earlier program wins.
            if best.is_none_or(|(highest, ..)| bid > highest) {
                best = Some((bid, program_id, program.target));
            }
        }
        let Some((_, winner, target)) = best else {
            break;
        };
        path.winner = winner;
        match target {
            Target::Atomic(_) => break,
            Target::Team(next) => team_id = next,
        }
    }
    path
}

/// The program's bid in this decision; runs it unless another visited team has.
#[inline(always)]
fn bid<const W: usize>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_>,
    team: &Team,
    program_id: ProgramId,
    program: &Program,
    path: &mut Path,
) -> f32 {
    let slot = usize::from(program_id.0);
    if let Some(bid) = machine.bids.get(slot)
        && !bid.is_nan()
    {
        return *bid;
    }
    if policy.header.register_mode == RegisterMode::Stateless {
        reset_registers(policy, machine.words, program);
    }
    run::<W>(policy, machine, team, program);
    path.instructions += u32::from(program.code_len);
    let bid = load(machine.words, program.state_start);
    if let Some(place) = machine.bids.get_mut(slot) {
        *place = bid;
    }
    bid
}

/// Sets a program's registers to their initial values.
#[inline(always)]
pub(crate) fn reset_registers(policy: &Policy<'_>, words: &mut [f32], program: &Program) {
    let len = program.register_words(usize::from(policy.header.width));
    fill_initial(
        policy,
        words,
        program.state_start,
        program.constants_start,
        len,
    );
}

/// Sets `len` words at `start` to the constants from `constants_start` on, or to zero if there are none.
pub(crate) fn fill_initial(
    policy: &Policy<'_>,
    words: &mut [f32],
    start: u16,
    constants_start: u32,
    len: usize,
) {
    let Some(place) = words
        .get_mut(usize::from(start)..)
        .and_then(|rest| rest.get_mut(..len))
    else {
        return;
    };
    match policy.header.initial_values {
        InitialValues::Zero => place.fill(0.0),
        InitialValues::Evolved => {
            let constants = policy.tables.constants.get(constants_start as usize..);
            for (word, bytes) in place.iter_mut().zip(constants.unwrap_or_default()) {
                *word = f32::from_le_bytes(*bytes);
            }
        }
    }
}

#[inline(always)]
fn load(words: &[f32], at: u16) -> f32 {
    words.get(usize::from(at)).copied().unwrap_or(0.0)
}

#[inline(always)]
fn store(words: &mut [f32], at: u16, value: f32) {
    if let Some(word) = words.get_mut(usize::from(at)) {
        *word = value;
    }
}

#[inline(always)]
fn run<const W: usize>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_>,
    team: &Team,
    program: &Program,
) {
    for bytes in policy.tables.code(program) {
        let Some(i) = Instruction::from_bytes(bytes) else {
            return;
        };
        let words = &mut *machine.words;
        let (a, b) = (load(words, i.a), load(words, i.b));
        let result = match i.op {
            Op::Add => math::add(a, b),
            Op::Sub => math::sub(a, b),
            Op::Mul => math::mul(a, b),
            Op::Div => math::div(a, b),
            Op::Min => math::min(a, b),
            Op::Max => math::max(a, b),
            Op::Pow => math::pow(a, b),
            Op::Abs => math::abs(a),
            Op::Recip => math::recip(a),
            Op::Sqr => math::sqr(a),
            Op::Cube => math::cube(a),
            Op::Sqrt => math::sqrt(a),
            Op::Sin => math::sin(a),
            Op::Cos => math::cos(a),
            Op::Tan => math::tan(a),
            Op::Asin => math::asin(a),
            Op::Acos => math::acos(a),
            Op::Atan => math::atan(a),
            Op::Tanh => math::tanh(a),
            Op::Exp => math::exp(a),
            Op::Log => math::log(a),
            Op::Heaviside => math::heaviside(a),
            Op::Cond => math::cond(load(words, i.d), a, b),
            Op::VElement | Op::MElement | Op::MemRead => a,
            Op::ClassicAdd => classic::add(load(words, i.d), a),
            Op::ClassicSub => classic::sub(load(words, i.d), a),
            Op::ClassicMult => classic::mult(load(words, i.d)),
            Op::ClassicDiv => classic::div(load(words, i.d)),
            Op::ClassicNeg => classic::neg(load(words, i.d), a),
            Op::ClassicCos => classic::cos(a),
            Op::ClassicLog => classic::log(load(words, i.d), a),
            Op::ClassicExp => classic::exp(a),
            _ => {
                wide::<W>(policy, machine, team, program, i);
                continue;
            }
        };
        store(words, i.d, result);
    }
}

/// A row of W words, copied to the stack, so that destinations may overlap sources.
#[inline(always)]
fn row<const W: usize>(words: &[f32], at: usize) -> [f32; W] {
    words
        .get(at..)
        .and_then(|rest| rest.first_chunk::<W>())
        .map_or([0.0; W], |row| *row)
}

#[inline(always)]
fn put_row<const W: usize>(words: &mut [f32], at: usize, value: &[f32; W]) {
    if let Some(place) = words
        .get_mut(at..)
        .and_then(|rest| rest.first_chunk_mut::<W>())
    {
        *place = *value;
    }
}

/// A W×W matrix in place.
#[inline(always)]
fn matrix<const W: usize>(words: &[f32], at: usize) -> Option<&[[f32; W]; W]> {
    let (rows, _) = words.get(at..)?.as_chunks::<W>();
    rows.first_chunk::<W>()
}

/// The elements of a matrix, row by row.
#[inline(always)]
fn elements<const W: usize>(words: &[f32], at: usize) -> &[f32] {
    matrix::<W>(words, at).map_or(&[], |rows| rows.as_flattened())
}

#[inline(always)]
fn put_matrix<const W: usize>(words: &mut [f32], at: usize, value: &[[f32; W]; W]) {
    for (r, row) in value.iter().enumerate() {
        put_row(words, at + r * W, row);
    }
}

/// One result for each row of the matrix at `at`.
#[inline(always)]
fn each_row<const W: usize>(words: &[f32], at: usize, f: impl Fn(&[f32]) -> f32) -> [f32; W] {
    let mut out = [0.0; W];
    for (r, out) in out.iter_mut().enumerate() {
        *out = f(&row::<W>(words, at + r * W));
    }
    out
}

/// Row by row, `f` of the rows at `a` and `b`, into the matrix at `d`.
#[inline(always)]
fn rows2<const W: usize>(
    words: &mut [f32],
    [d, a, b]: [usize; 3],
    f: impl Fn(&[f32; W], &[f32; W]) -> [f32; W],
) {
    for offset in (0..W).map(|r| r * W) {
        let value = f(&row(words, a + offset), &row(words, b + offset));
        put_row(words, d + offset, &value);
    }
}

/// Everything that touches vectors, matrices, constants or shared memory.
#[inline(never)]
fn wide<const W: usize>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_>,
    team: &Team,
    program: &Program,
    i: Instruction,
) {
    let words = &mut *machine.words;
    let [d, a, b] = [i.d, i.a, i.b].map(usize::from);
    macro_rules! v2 {
        ($f:expr) => {
            put_row(
                words,
                d,
                &math::zip::<W>(&row(words, a), &row(words, b), $f),
            )
        };
    }
    macro_rules! v1 {
        ($f:expr) => {
            put_row(words, d, &math::map::<W>(&row(words, a), $f))
        };
    }
    macro_rules! m2 {
        ($f:expr) => {
            rows2::<W>(words, [d, a, b], |x, y| math::zip(x, y, $f))
        };
    }
    macro_rules! m1 {
        ($f:expr) => {
            rows2::<W>(words, [d, a, a], |x, _| math::map(x, $f))
        };
    }
    match i.op {
        Op::VAdd => v2!(math::add),
        Op::VSub => v2!(math::sub),
        Op::VMul => v2!(math::mul),
        Op::VDiv => v2!(math::div),
        Op::VMin => v2!(math::min),
        Op::VMax => v2!(math::max),
        Op::VAbs => v1!(math::abs),
        Op::VRecip => v1!(math::recip),
        Op::VHeaviside => v1!(math::heaviside),
        Op::VScale => {
            let s = load(words, i.a);
            put_row(
                words,
                d,
                &math::map::<W>(&row(words, b), |x| math::mul(s, x)),
            );
        }
        Op::VBroadcast => put_row(words, d, &[load(words, i.a); W]),
        Op::Dot => store(words, i.d, math::dot::<W>(&row(words, a), &row(words, b))),
        Op::VNorm => store(words, i.d, math::norm(&row::<W>(words, a))),
        Op::VMean => store(words, i.d, math::mean(&row::<W>(words, a))),
        Op::VStd => store(words, i.d, math::std(&row::<W>(words, a))),
        Op::MatVec => {
            let x = row(words, b);
            if let Some(value) = matrix::<W>(words, a).map(|m| math::mat_vec(m, &x)) {
                put_row(words, d, &value);
            }
        }
        Op::RowNorm => put_row(words, d, &each_row::<W>(words, a, math::norm)),
        Op::RowMean => put_row(words, d, &each_row::<W>(words, a, math::mean)),
        Op::RowStd => put_row(words, d, &each_row::<W>(words, a, math::std)),
        Op::ColumnNorm => {
            if let Some(value) = matrix::<W>(words, a).map(math::column_norm) {
                put_row(words, d, &value);
            }
        }
        Op::MAdd => m2!(math::add),
        Op::MSub => m2!(math::sub),
        Op::MMul => m2!(math::mul),
        Op::MDiv => m2!(math::div),
        Op::MMin => m2!(math::min),
        Op::MMax => m2!(math::max),
        Op::MAbs => m1!(math::abs),
        Op::MRecip => m1!(math::recip),
        Op::MHeaviside => m1!(math::heaviside),
        Op::Transpose => {
            if let Some(value) = matrix::<W>(words, a).map(math::transpose) {
                put_matrix(words, d, &value);
            }
        }
        Op::MScale => {
            let s = load(words, i.a);
            rows2::<W>(words, [d, b, b], |x, _| math::map(x, |x| math::mul(s, x)));
        }
        Op::Outer => {
            let (x, y) = (row::<W>(words, a), row::<W>(words, b));
            for (r, x) in x.iter().enumerate() {
                put_row(words, d + r * W, &math::map(&y, |y| math::mul(*x, y)));
            }
        }
        Op::MatMul => {
            let product = matrix::<W>(words, a)
                .zip(matrix::<W>(words, b))
                .map(|(x, y)| math::mat_mul(x, y));
            if let Some(value) = product {
                put_matrix(words, d, &value);
            }
        }
        Op::BroadcastRows => put_matrix(words, d, &[row::<W>(words, a); W]),
        Op::BroadcastColumns => {
            for (r, x) in row::<W>(words, a).iter().enumerate() {
                put_row(words, d + r * W, &[*x; W]);
            }
        }
        Op::MNorm => store(words, i.d, math::norm(elements::<W>(words, a))),
        Op::MMean => store(words, i.d, math::mean(elements::<W>(words, a))),
        Op::MStd => store(words, i.d, math::std(elements::<W>(words, a))),
        Op::ReloadS => reload(policy, words, program, i.d, 1),
        Op::ReloadV => reload(policy, words, program, i.d, W),
        Op::ReloadM => reload(policy, words, program, i.d, W * W),
        Op::WriteS => write(machine, team, Section::Scalar, a, W),
        Op::WriteV => write(machine, team, Section::Vector, a, W),
        Op::WriteM => write(machine, team, Section::Matrix, a, W),
        Op::ReadS => read(words, team, Section::Scalar, i, W),
        Op::ReadV => read(words, team, Section::Vector, i, W),
        Op::ReadM => read(words, team, Section::Matrix, i, W),
        Op::ReadWholeV => read_whole(words, team, Section::Vector, [d, a], W),
        Op::ReadWholeM => read_whole(words, team, Section::Matrix, [d, a], W),
        Op::MemWrite => write_indexed(policy, machine, program),
        _ => {}
    }
}

/// Sets a register to its evolved constant: both lie equally far from their starts.
fn reload(policy: &Policy<'_>, words: &mut [f32], program: &Program, d: u16, len: usize) {
    let offset = u32::from(d.saturating_sub(program.state_start));
    fill_initial(policy, words, d, program.constants_start + offset, len);
}

/// Writes a register to a slot drawn at random (thesis Equation 3.4.1); slots that nobody reads are not kept.
fn write(machine: &mut Machine<'_>, team: &Team, section: Section, source: usize, width: usize) {
    let Some(stream) = team
        .stream(section)
        .and_then(|s| machine.streams.get_mut(s))
    else {
        return;
    };
    let slot = slot_of(stream.next_u32());
    let Some(start) = team.slot_start(section, slot, width) else {
        return;
    };
    copy(machine.words, source, start, section.slot_words(width));
}

/// Copies words within the state, one by one: `copy_within` would bring a panic into the decision.
fn copy(words: &mut [f32], from: usize, to: usize, len: usize) {
    for k in 0..len {
        let value = words.get(from + k).copied();
        if let (Some(value), Some(place)) = (value, words.get_mut(to + k)) {
            *place = value;
        }
    }
}

fn read(words: &mut [f32], team: &Team, section: Section, i: Instruction, width: usize) {
    if let Some(start) = team.slot_start(section, usize::from(i.a), width) {
        copy(words, start + usize::from(i.b), usize::from(i.d), 1);
    }
}

fn read_whole(
    words: &mut [f32],
    team: &Team,
    section: Section,
    [d, slot]: [usize; 2],
    width: usize,
) {
    if let Some(start) = team.slot_start(section, slot, width) {
        copy(words, start, d, section.slot_words(width));
    }
}

/// Overwrites each kept cell, with its probability, by the register of its column (thesis Equation 2.4.2).
fn write_indexed(policy: &Policy<'_>, machine: &mut Machine<'_>, program: &Program) {
    let write = machine.indexed.begin_write();
    let first = policy.cells_start();
    for (k, bytes) in policy.tables.cells.iter().enumerate() {
        let cell = u16::from_le_bytes(*bytes);
        if machine.indexed.reaches(write, cell) {
            let column = usize::from(cell) % REGISTERS;
            copy(
                machine.words,
                usize::from(program.state_start) + column,
                first + k,
                1,
            );
        }
    }
}
