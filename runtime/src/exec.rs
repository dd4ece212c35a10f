//! One decision: walk the teams, run their programs. Bounded, cannot panic.
//!
//! Every offset was checked by [`crate::verify`]; accesses go through `get`, so that even a policy
//! built by a faulty verifier could only compute a wrong number.

mod rows;
mod shared;

use crate::blob::{InitialValues, RegisterMode};
use crate::isa::Op;
use crate::math::{self, classic};
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::tables::{Instruction, Program, ProgramId, Section, Target, Team, TeamId};
use crate::trace::Observer;
use crate::verify::Policy;

use rows::{each_row, elements, matrix, put_matrix, put_row, row, rows2};
use shared::{read, read_cell, read_whole, reload, write, write_indexed};

/// The changing state of an agent, wherever it is kept.
pub struct Machine<'s, O> {
    pub words: &'s mut [f32],
    /// Bid of every program that ran in this decision, else NaN, which no bid ever is.
    pub bids: &'s mut [f32],
    pub visited: &'s mut [bool],
    pub streams: &'s mut [Pcg32],
    pub indexed: &'s mut IndexedStream,
    pub observer: O,
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
pub(crate) fn decide<const W: usize, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, O>,
) -> Path {
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
        machine.observer.enter(team_id);
        let mut best: Option<(f32, ProgramId, Target)> = None;
        for program_id in policy.tables.members(&team) {
            let Some(program) = policy.tables.program(program_id) else {
                continue;
            };
            if let Target::Team(TeamId(next)) = program.target
                && machine.visited.get(usize::from(next)).is_none_or(|v| *v)
            {
                machine.observer.skip(program_id);
                continue;
            }
            let bid = bid::<W, O>(policy, machine, &team, program_id, &program, &mut path);
            machine.observer.bid(program_id, bid);
            // Only a higher bid takes over: of equals the earlier program wins.
            if best.is_none_or(|(highest, ..)| bid > highest) {
                best = Some((bid, program_id, program.target));
            }
        }
        let Some((_, winner, target)) = best else {
            break;
        };
        path.winner = winner;
        machine.observer.choose(winner, target);
        match target {
            Target::Atomic(_) => break,
            Target::Team(next) => team_id = next,
        }
    }
    path
}

/// The program's bid in this decision; runs it unless another visited team has.
#[inline(always)]
fn bid<const W: usize, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, O>,
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
    machine.observer.run(program_id, program.code_len);
    run::<W, O>(policy, machine, team, program);
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
fn run<const W: usize, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, O>,
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
            Op::VElement | Op::MElement => a,
            Op::MemRead => {
                read_cell(policy, &mut machine.observer, i.a);
                a
            }
            Op::ClassicAdd => classic::add(load(words, i.d), a),
            Op::ClassicSub => classic::sub(load(words, i.d), a),
            Op::ClassicMult => classic::mult(load(words, i.d)),
            Op::ClassicDiv => classic::div(load(words, i.d)),
            Op::ClassicNeg => classic::neg(load(words, i.d), a),
            Op::ClassicCos => classic::cos(a),
            Op::ClassicLog => classic::log(load(words, i.d), a),
            Op::ClassicExp => classic::exp(a),
            _ => {
                wide::<W, O>(policy, machine, team, program, i);
                continue;
            }
        };
        store(words, i.d, result);
    }
}

/// Everything that touches vectors, matrices, constants or shared memory.
#[inline(never)]
fn wide<const W: usize, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, O>,
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
        Op::ReadS => read(machine, team, Section::Scalar, i, W),
        Op::ReadV => read(machine, team, Section::Vector, i, W),
        Op::ReadM => read(machine, team, Section::Matrix, i, W),
        Op::ReadWholeV => read_whole(machine, team, Section::Vector, [d, a], W),
        Op::ReadWholeM => read_whole(machine, team, Section::Matrix, [d, a], W),
        Op::MemWrite => write_indexed(policy, machine, program),
        _ => {}
    }
}
