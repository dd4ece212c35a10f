//! A policy for test-v1 (none), compiled.
//!
//! Made by: TPG_ACCEPT=1 cargo test -p tpg-tests --test compiled timed
//! Provenance: 07070707070707070707070707070707
//! Registers stateless, reset every-decision, memory none, W = 4; a decision every 20000 us.
//! Decides as tpg-runtime does with the policy's file, bit for bit. Do not edit: export it again.
//!
//! Inputs:
//!   0: x [m]
//!   1: x [m]
//!   2: x [m]
//!   3: x [m]
#![allow(unused, clippy::all, clippy::pedantic)]

use tpg_runtime::memory::{IndexedStream, WriteDistribution, draw_slot, slot_stream};
use tpg_runtime::rng::Pcg32;
use tpg_runtime::tables::Section;
use tpg_runtime::{Reset, math};

/// Length of an observation.
pub const INPUTS: usize = 4;
/// Time between two decisions, in microseconds.
pub const CONTROL_PERIOD_US: u32 = 20000;
/// Words of shared memory.
pub const MEMORY: usize = 0;
/// Index of one of 2 actions.
pub type Action = u16;

const W: usize = 4;
type Vector = [f32; W];
type Matrix = [Vector; W];
type Window = [f32; 16];

/// One decision: the action and how it came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// What the plant is to do.
    pub action: Action,
    /// Number of the program that won at the last team.
    pub winner: u16,
    /// Instructions executed.
    pub instructions: u32,
    /// Teams visited.
    pub teams: u16,
}

/// The policy with its state: registers, shared memory, random streams.
#[derive(Debug, Clone)]
pub struct Policy {
}

impl Policy {
    /// As loaded: everything reset, with seed 0.
    #[must_use]
    pub fn new() -> Self {
        Policy {
        }
    }

    /// Begins an agent's evaluation or one of its episodes; the reset scope is every-decision.
    ///
    /// `agent_seed` determines the random streams.
    pub fn reset(&mut self, what: Reset, agent_seed: u64) {
    }

    /// Chooses the action for an observation; its non-finite elements count as 0.
    pub fn decide(&mut self, observation: &[f32; INPUTS]) -> Decision {
        let mut x = [0.0; 16];
        let (first, rest) = x.split_at_mut(INPUTS);
        for (x, element) in first.iter_mut().zip(observation) {
            *x = math::finite(*element);
        }
        for again in rest.chunks_mut(INPUTS) {
            for (x, element) in again.iter_mut().zip(&*first) {
                *x = *element;
            }
        }
        let x = &x;
        let (mut team, mut winner, mut instructions, mut teams) = (0u16, 0u16, 0u32, 0u16);
        for _ in 0..7 {
            teams += 1;
            let mut best = f32::NEG_INFINITY;
            team = match team {
                0 => {
                    instructions += 76;
                    let bid_0 = program_0(x);
                    if bid_0 > best { best = bid_0; winner = 0; }
                    let bid_1 = program_1(x);
                    if bid_1 > best { best = bid_1; winner = 1; }
                    let bid_2 = program_2(x);
                    if bid_2 > best { best = bid_2; winner = 2; }
                    let bid_3 = program_3(x);
                    if bid_3 > best { best = bid_3; winner = 3; }
                    match winner { 0 => 1, 1 => 1, 2 => 5, _ => break }
                }
                1 => {
                    instructions += 77;
                    let bid_4 = program_4(x);
                    if bid_4 > best { best = bid_4; winner = 4; }
                    let bid_5 = program_5(x);
                    if bid_5 > best { best = bid_5; winner = 5; }
                    let bid_6 = program_6(x);
                    if bid_6 > best { best = bid_6; winner = 6; }
                    let bid_7 = program_7(x);
                    if bid_7 > best { best = bid_7; winner = 7; }
                    match winner { 4 => 6, 5 => 8, 6 => 4, _ => break }
                }
                2 => {
                    instructions += 57;
                    let bid_8 = program_8(x);
                    if bid_8 > best { best = bid_8; winner = 8; }
                    let bid_9 = program_9(x);
                    if bid_9 > best { best = bid_9; winner = 9; }
                    let bid_11 = program_11(x);
                    if bid_11 > best { best = bid_11; winner = 11; }
                    match winner { 8 => 8, _ => break }
                }
                4 => {
                    instructions += 84;
                    let bid_16 = program_16(x);
                    if bid_16 > best { best = bid_16; winner = 16; }
                    let bid_17 = program_17(x);
                    if bid_17 > best { best = bid_17; winner = 17; }
                    let bid_18 = program_18(x);
                    if bid_18 > best { best = bid_18; winner = 18; }
                    let bid_19 = program_19(x);
                    if bid_19 > best { best = bid_19; winner = 19; }
                    match winner { 16 => 6, _ => break }
                }
                5 => {
                    instructions += 76;
                    let bid_20 = program_20(x);
                    if bid_20 > best { best = bid_20; winner = 20; }
                    let bid_21 = program_21(x);
                    if bid_21 > best { best = bid_21; winner = 21; }
                    let bid_22 = program_22(x);
                    if bid_22 > best { best = bid_22; winner = 22; }
                    let bid_23 = program_23(x);
                    if bid_23 > best { best = bid_23; winner = 23; }
                    match winner { 20 => 4, 21 => 2, 22 => 6, _ => break }
                }
                6 => {
                    instructions += 54;
                    let bid_24 = program_24(x);
                    if bid_24 > best { best = bid_24; winner = 24; }
                    let bid_25 = program_25(x);
                    if bid_25 > best { best = bid_25; winner = 25; }
                    let bid_27 = program_27(x);
                    if bid_27 > best { best = bid_27; winner = 27; }
                    break
                }
                8 => {
                    instructions += 55;
                    let bid_32 = program_32(x);
                    if bid_32 > best { best = bid_32; winner = 32; }
                    let bid_33 = program_33(x);
                    if bid_33 > best { best = bid_33; winner = 33; }
                    let bid_34 = program_34(x);
                    if bid_34 > best { best = bid_34; winner = 34; }
                    match winner { 32 => 6, _ => break }
                }
                _ => break,
            };
        }
        let action = match winner { 18 => 1, 19 => 1, 25 => 1, 27 => 1, 3 => 1, 34 => 1, 9 => 1, _ => 0 };
        Decision { action, winner, instructions, teams }
    }
}

/// Program 0 -> team 1.
fn program_0(x: &Window) -> f32 {
    let mut s0 = -0.2544764;
    let mut s1 = 0.8030169;
    let mut s2 = 0.30170494;
    let mut s3 = 0.61460036;
    let mut s4 = -0.03999713;
    let mut s5 = -0.4898048;
    let mut s6 = -0.39751795;
    let mut s7 = -0.9367662;
    s7 = math::sub(x[1], s0);
    s5 = math::mul(s7, s2);
    s1 = math::sub(x[1], x[2]);
    s0 = math::log(x[3]);
    s1 = math::log(s1);
    s1 = math::cond(s1, s3, s0);
    s2 = math::log(x[0]);
    s5 = math::div(x[1], s5);
    s2 = math::cond(s2, s5, s1);
    s4 = math::add(s2, s1);
    s7 = math::log(s4);
    s3 = math::div(x[1], s0);
    s5 = math::sub(s3, s7);
    s1 = math::log(s5);
    s1 = math::add(x[1], s1);
    s2 = math::cos(x[0]);
    s3 = math::log(x[3]);
    s7 = math::sub(s2, s1);
    s5 = math::exp(s3);
    s6 = math::cos(s5);
    s4 = math::cos(s6);
    s2 = math::log(s7);
    s0 = math::mul(s4, s2);
    s0
}

/// Program 1 -> team 1.
fn program_1(x: &Window) -> f32 {
    let mut s0 = -0.011411807;
    let mut s1 = 0.6777947;
    let mut s2 = -0.75708455;
    let mut s3 = 0.83676684;
    let mut s4 = 0.51797384;
    let mut s5 = 0.001099236;
    let mut s6 = -0.5128791;
    s4 = math::log(s2);
    s3 = math::log(s4);
    s1 = math::log(x[3]);
    s0 = math::exp(s3);
    s4 = math::add(s1, s0);
    s1 = math::exp(s4);
    s2 = math::cos(s1);
    s3 = math::cos(s2);
    s4 = math::div(x[2], s3);
    s6 = math::add(x[0], x[3]);
    s3 = math::cond(s3, s6, s4);
    s3 = math::exp(s3);
    s5 = math::exp(s3);
    s4 = math::sub(s5, x[3]);
    s0 = math::exp(x[2]);
    s0 = math::cond(s0, x[2], s4);
    s0 = math::mul(x[1], s0);
    s0
}

/// Program 2 -> team 5.
fn program_2(x: &Window) -> f32 {
    let mut s0 = -0.5080662;
    let mut s1 = -0.90614086;
    let mut s2 = -0.54014504;
    let mut s3 = 0.5489298;
    let mut s4 = -0.06430036;
    let mut s5 = 0.31378603;
    let mut s6 = -0.4263766;
    let mut s7 = 0.62809056;
    s0 = math::add(x[1], x[3]);
    s1 = math::log(s7);
    s5 = math::mul(s0, s1);
    s3 = math::exp(s5);
    s6 = math::div(x[0], s3);
    s1 = math::div(s0, s6);
    s7 = math::log(s1);
    s4 = math::div(x[3], s7);
    s6 = math::cos(s4);
    s4 = math::log(s6);
    s7 = math::log(x[2]);
    s1 = math::mul(s6, x[2]);
    s5 = math::log(s6);
    s2 = math::div(s7, s4);
    s5 = math::cond(s5, s1, x[0]);
    s1 = math::add(s1, s2);
    s2 = math::mul(x[1], s1);
    s0 = math::cos(s2);
    s0 = math::mul(s0, s5);
    s0
}

/// Program 3 -> action 1.
fn program_3(x: &Window) -> f32 {
    let mut s0 = -0.9974306;
    let mut s1 = -0.26341957;
    let mut s2 = 0.8874054;
    let mut s4 = 0.46718672;
    let mut s5 = 0.6904271;
    let mut s6 = 0.103592396;
    let mut s7 = -0.43686706;
    s2 = math::sub(s7, s0);
    s1 = math::log(s2);
    s6 = math::cos(x[3]);
    s4 = math::add(s6, s1);
    s2 = math::cos(s4);
    s4 = math::mul(x[1], s2);
    s7 = math::add(s4, x[2]);
    s0 = math::sub(s7, x[2]);
    s4 = math::div(x[2], s0);
    s4 = math::cond(s4, s4, x[2]);
    s2 = math::mul(x[1], s0);
    s4 = math::cond(s4, x[2], s2);
    s0 = math::log(s4);
    s2 = math::div(s0, s4);
    s0 = math::exp(s2);
    s5 = math::cos(s0);
    s0 = math::log(s5);
    s0
}

/// Program 4 -> team 6.
fn program_4(x: &Window) -> f32 {
    let mut s0 = -0.24324507;
    let mut s2 = 0.37587023;
    let mut s3 = 0.64913815;
    let mut s4 = 0.5492745;
    let mut s5 = 0.33499146;
    let mut s6 = -0.55496085;
    let mut s7 = 0.8741816;
    s5 = math::cos(s4);
    s7 = math::sub(s5, s5);
    s2 = math::add(x[1], s7);
    s7 = math::log(s2);
    s2 = math::sub(x[0], x[2]);
    s3 = math::sub(s7, s7);
    s3 = math::add(s2, s3);
    s7 = math::exp(x[2]);
    s2 = math::div(s3, x[2]);
    s5 = math::sub(s2, s7);
    s5 = math::cos(s5);
    s2 = math::cos(s5);
    s0 = math::div(x[1], s2);
    s3 = math::cos(s0);
    s7 = math::exp(s3);
    s0 = math::add(s7, s7);
    s2 = math::div(x[0], s0);
    s3 = math::exp(s2);
    s0 = math::sub(x[3], s3);
    s3 = math::add(s0, x[3]);
    s6 = math::mul(x[1], x[1]);
    s3 = math::cond(s3, s6, s3);
    s0 = math::exp(s3);
    s0
}

/// Program 5 -> team 8.
fn program_5(x: &Window) -> f32 {
    let mut s0 = -0.85931927;
    let mut s1 = -0.37241971;
    let mut s2 = 0.39740118;
    let mut s3 = 0.51337296;
    let mut s4 = 0.53788656;
    let mut s5 = -0.64722925;
    let mut s6 = -0.70325404;
    let mut s7 = -0.5868234;
    s7 = math::add(s1, s1);
    s2 = math::exp(s4);
    s5 = math::sub(x[1], s7);
    s4 = math::cos(s5);
    s1 = math::sub(s2, x[3]);
    s2 = math::mul(s4, x[2]);
    s3 = math::log(x[0]);
    s0 = math::add(s2, s1);
    s3 = math::exp(s3);
    s3 = math::cond(s3, x[1], s3);
    s5 = math::add(s3, s0);
    s3 = math::exp(x[2]);
    s3 = math::cond(s3, s5, s3);
    s3 = math::cond(s3, x[2], x[3]);
    s7 = math::div(x[2], s0);
    s6 = math::div(s7, x[2]);
    s0 = math::sub(s6, s3);
    s0
}

/// Program 6 -> team 4.
fn program_6(x: &Window) -> f32 {
    let mut s0 = 0.480087;
    let mut s1 = -0.3249651;
    let mut s2 = -0.41088182;
    let mut s3 = -0.021291466;
    let mut s4 = -0.17222378;
    let mut s5 = 0.80771774;
    let mut s6 = -0.35178715;
    let mut s7 = -0.9598843;
    s6 = math::exp(s6);
    s1 = math::log(s6);
    s5 = math::mul(s1, s0);
    s2 = math::log(s5);
    s5 = math::sub(x[0], s2);
    s6 = math::cos(s5);
    s7 = math::exp(s6);
    s1 = math::exp(s7);
    s6 = math::mul(x[0], s1);
    s7 = math::div(x[2], s6);
    s4 = math::div(s7, s6);
    s1 = math::log(x[1]);
    s5 = math::exp(x[3]);
    s3 = math::mul(x[3], x[2]);
    s3 = math::cond(s3, s1, x[2]);
    s2 = math::log(s5);
    s0 = math::div(s2, s4);
    s3 = math::mul(s3, s0);
    s0 = math::mul(s3, x[3]);
    s0
}

/// Program 7 -> action 0.
fn program_7(x: &Window) -> f32 {
    let mut s0 = -0.65713245;
    let mut s1 = 0.8941274;
    let mut s2 = -0.20645627;
    let mut s3 = 0.74017024;
    let mut s4 = 0.011309003;
    let mut s6 = 0.18041365;
    let mut s7 = 0.44051674;
    s4 = math::log(s2);
    s4 = math::mul(s4, s1);
    s3 = math::exp(s4);
    s7 = math::sub(x[1], x[1]);
    s7 = math::mul(s3, s7);
    s3 = math::exp(s7);
    s4 = math::mul(x[3], x[2]);
    s1 = math::cos(s4);
    s3 = math::log(s3);
    s6 = math::add(s1, x[2]);
    s6 = math::cond(s6, s6, x[0]);
    s6 = math::exp(s6);
    s2 = math::cos(s3);
    s0 = math::mul(s6, s2);
    s3 = math::sub(s0, x[1]);
    s0 = math::div(x[3], s0);
    s0 = math::mul(s0, s3);
    s0 = math::div(x[3], s0);
    s0
}

/// Program 8 -> team 8.
fn program_8(x: &Window) -> f32 {
    let mut s0 = 0.58655643;
    let mut s1 = -0.13794662;
    let mut s2 = -0.22875339;
    let mut s3 = -0.22027378;
    let mut s4 = -0.86988163;
    let mut s5 = 0.1847273;
    let mut s6 = -0.5716291;
    let mut s7 = -0.872171;
    s1 = math::mul(s3, s3);
    s3 = math::add(s1, x[2]);
    s5 = math::add(x[1], x[2]);
    s2 = math::exp(x[2]);
    s1 = math::div(s3, s2);
    s1 = math::mul(s1, x[2]);
    s5 = math::cond(s5, s1, x[0]);
    s2 = math::cos(s5);
    s7 = math::add(x[2], s2);
    s1 = math::mul(s7, s5);
    s2 = math::exp(s7);
    s4 = math::sub(s1, s2);
    s6 = math::log(s4);
    s4 = math::exp(s6);
    s4 = math::cos(s4);
    s5 = math::exp(s4);
    s0 = math::exp(s5);
    s0
}

/// Program 9 -> action 1.
fn program_9(x: &Window) -> f32 {
    let mut s0 = -0.37097353;
    let mut s1 = 0.832073;
    let mut s2 = 0.5965148;
    let mut s3 = 0.8857923;
    let mut s4 = -0.882967;
    let mut s5 = 0.31415653;
    let mut s6 = 0.44423887;
    s3 = math::sub(s3, s4);
    s4 = math::cond(s4, s3, s5);
    s5 = math::log(s4);
    s5 = math::div(s5, s5);
    s0 = math::div(s5, s5);
    s4 = math::cos(s0);
    s1 = math::cos(s4);
    s5 = math::div(s1, x[2]);
    s0 = math::log(x[1]);
    s4 = math::sub(s0, x[2]);
    s4 = math::log(s4);
    s5 = math::add(s5, s4);
    s4 = math::cos(s5);
    s6 = math::log(x[2]);
    s3 = math::exp(s6);
    s6 = math::cond(s6, s4, s3);
    s2 = math::sub(x[1], s6);
    s0 = math::cos(s2);
    s0
}

/// Program 11 -> action 0.
fn program_11(x: &Window) -> f32 {
    let mut s0 = 0.3748792;
    let mut s1 = 0.2400407;
    let mut s2 = 0.5313627;
    let mut s3 = -0.9974002;
    let mut s4 = -0.26500517;
    let mut s5 = 0.7292201;
    let mut s6 = -0.7172644;
    let mut s7 = 0.10692563;
    s2 = math::add(x[1], s6);
    s5 = math::cos(s1);
    s4 = math::div(s5, s2);
    s7 = math::div(s7, x[2]);
    s6 = math::add(s7, x[2]);
    s1 = math::sub(s2, x[3]);
    s3 = math::exp(s1);
    s4 = math::cond(s4, s6, s3);
    s5 = math::cos(x[1]);
    s6 = math::log(s5);
    s4 = math::cond(s4, s6, x[2]);
    s6 = math::cos(x[2]);
    s5 = math::log(s6);
    s3 = math::div(s5, x[1]);
    s1 = math::cos(x[1]);
    s0 = math::log(s1);
    s6 = math::add(x[2], s3);
    s6 = math::cond(s6, x[2], s4);
    s0 = math::cond(s0, s0, s6);
    s7 = math::log(s3);
    s0 = math::cond(s0, s7, s0);
    s0 = math::log(s0);
    s0
}

/// Program 16 -> team 6.
fn program_16(x: &Window) -> f32 {
    let mut s0 = -0.8232503;
    let mut s1 = 0.20269696;
    let mut s2 = -0.52556944;
    let mut s3 = -0.80474335;
    let mut s5 = -0.9973009;
    let mut s6 = -0.35181454;
    let mut s7 = -0.27201748;
    s0 = math::exp(x[2]);
    s5 = math::log(x[1]);
    s7 = math::cos(s3);
    s0 = math::cond(s0, x[0], s2);
    s6 = math::log(s7);
    s0 = math::cond(s0, s0, s6);
    s3 = math::sub(s5, s5);
    s0 = math::div(s0, s0);
    s3 = math::sub(s3, s3);
    s7 = math::cos(s0);
    s3 = math::add(s3, s0);
    s1 = math::exp(s0);
    s5 = math::div(s0, s3);
    s2 = math::div(s5, s1);
    s1 = math::add(s2, s7);
    s1 = math::cos(s1);
    s3 = math::exp(s1);
    s5 = math::div(s1, s3);
    s6 = math::cos(s5);
    s0 = math::add(s6, x[0]);
    s0
}

/// Program 17 -> action 0.
fn program_17(x: &Window) -> f32 {
    let mut s0 = 0.70595;
    let mut s1 = -0.98928493;
    let mut s2 = 0.183993;
    let mut s3 = 0.28783256;
    let mut s4 = 0.75822675;
    let mut s5 = 0.5567616;
    let mut s6 = 0.44666976;
    let mut s7 = -0.031523325;
    s0 = math::log(x[2]);
    s0 = math::cos(s0);
    s4 = math::add(s1, s0);
    s6 = math::add(s1, s4);
    s3 = math::sub(s0, s6);
    s1 = math::add(s3, x[3]);
    s0 = math::div(s1, s6);
    s7 = math::sub(s6, s0);
    s3 = math::cos(s1);
    s4 = math::mul(s3, s7);
    s0 = math::log(x[2]);
    s2 = math::exp(s0);
    s4 = math::cond(s4, x[0], s4);
    s0 = math::cond(s0, s4, s2);
    s3 = math::log(s0);
    s1 = math::div(x[3], x[1]);
    s6 = math::mul(s3, s1);
    s0 = math::log(x[2]);
    s5 = math::cos(s0);
    s7 = math::add(s5, s6);
    s0 = math::add(s7, x[1]);
    s3 = math::exp(s0);
    s0 = math::cos(s3);
    s0
}

/// Program 18 -> action 1.
fn program_18(x: &Window) -> f32 {
    let mut s0 = -0.079912625;
    let mut s1 = -0.7856229;
    let mut s2 = -0.74699557;
    let mut s3 = -0.3166037;
    let mut s4 = -0.7153579;
    let mut s5 = 0.9860591;
    let mut s6 = -0.90542805;
    let mut s7 = -0.9014163;
    s2 = math::cos(s3);
    s1 = math::exp(s2);
    s4 = math::add(x[1], s1);
    s7 = math::add(s4, x[2]);
    s7 = math::mul(x[0], s7);
    s5 = math::cos(s7);
    s6 = math::mul(x[1], s5);
    s7 = math::div(x[0], x[0]);
    s1 = math::sub(s6, x[0]);
    s0 = math::mul(s7, s7);
    s5 = math::div(s1, s0);
    s2 = math::mul(s5, x[0]);
    s0 = math::log(s2);
    s5 = math::div(s0, x[0]);
    s1 = math::sub(x[2], s5);
    s7 = math::add(x[2], s1);
    s5 = math::mul(x[2], s7);
    s7 = math::add(x[0], s5);
    s2 = math::log(s7);
    s4 = math::cos(s2);
    s0 = math::log(s4);
    s0
}

/// Program 19 -> action 1.
fn program_19(x: &Window) -> f32 {
    let mut s0 = -0.8350668;
    let mut s1 = 0.2671038;
    let mut s2 = -0.5068852;
    let mut s3 = 0.864697;
    let mut s4 = -0.4694572;
    let mut s5 = 0.82424986;
    let mut s6 = 0.22305992;
    let mut s7 = 0.5979222;
    s2 = math::add(s6, x[1]);
    s1 = math::mul(s5, x[1]);
    s7 = math::log(x[0]);
    s3 = math::mul(x[2], s1);
    s3 = math::sub(s1, s3);
    s0 = math::sub(s3, s1);
    s2 = math::cond(s2, x[2], s0);
    s6 = math::add(s7, s3);
    s5 = math::div(s2, s6);
    s7 = math::log(x[2]);
    s7 = math::cond(s7, x[3], x[0]);
    s3 = math::cond(s3, s7, x[1]);
    s2 = math::cond(s2, s3, s3);
    s7 = math::div(s2, s2);
    s4 = math::sub(s5, s3);
    s0 = math::div(s7, s2);
    s1 = math::sub(s4, x[0]);
    s1 = math::mul(s1, s7);
    s2 = math::div(s6, s1);
    s0 = math::cond(s0, s2, x[2]);
    s0
}

/// Program 20 -> team 4.
fn program_20(x: &Window) -> f32 {
    let mut s0 = 0.34570634;
    let mut s1 = -0.12539394;
    let mut s2 = -0.9469638;
    let mut s3 = -0.051502638;
    let mut s4 = -0.9911249;
    let mut s5 = -0.517122;
    let mut s6 = 0.8414021;
    let mut s7 = -0.13650855;
    s3 = math::exp(s6);
    s4 = math::cond(s4, s5, s4);
    s2 = math::cond(s2, x[2], s3);
    s7 = math::cos(s4);
    s1 = math::cos(x[1]);
    s0 = math::div(s1, x[0]);
    s4 = math::log(s2);
    s6 = math::sub(s4, s1);
    s4 = math::cond(s4, x[0], s6);
    s1 = math::mul(x[1], s7);
    s0 = math::div(s0, x[0]);
    s2 = math::cos(s4);
    s7 = math::exp(s4);
    s1 = math::cond(s1, s7, s2);
    s5 = math::mul(s1, x[1]);
    s6 = math::log(s5);
    s0 = math::cond(s0, s6, x[2]);
    s0
}

/// Program 21 -> team 2.
fn program_21(x: &Window) -> f32 {
    let mut s0 = -0.8161592;
    let mut s1 = -0.028938878;
    let mut s2 = 0.7278551;
    let mut s3 = -0.3939384;
    let mut s5 = 0.35650125;
    let mut s6 = -0.6272212;
    let mut s7 = 0.031487677;
    s7 = math::div(x[2], s6);
    s1 = math::add(s5, x[0]);
    s0 = math::cos(s7);
    s5 = math::mul(s1, x[2]);
    s2 = math::cos(s7);
    s1 = math::mul(s0, s5);
    s5 = math::exp(s1);
    s7 = math::mul(s2, x[0]);
    s0 = math::cos(s7);
    s3 = math::sub(s5, s7);
    s1 = math::exp(s7);
    s3 = math::exp(s3);
    s2 = math::log(s1);
    s0 = math::add(s0, s7);
    s7 = math::exp(s2);
    s0 = math::cond(s0, x[3], s3);
    s0 = math::add(s7, s0);
    s0
}

/// Program 22 -> team 6.
fn program_22(x: &Window) -> f32 {
    let mut s0 = 0.6370571;
    let mut s1 = -0.7986059;
    let mut s2 = -0.8841915;
    let mut s3 = 0.20418108;
    let mut s4 = 0.45545372;
    let mut s5 = -0.5727784;
    let mut s6 = -0.895924;
    let mut s7 = 0.2811227;
    s3 = math::cond(s3, s0, s7);
    s5 = math::div(x[3], s3);
    s6 = math::cond(s6, s5, x[0]);
    s2 = math::mul(s6, s6);
    s4 = math::mul(s2, x[0]);
    s5 = math::exp(s2);
    s0 = math::sub(s4, x[1]);
    s1 = math::add(s0, s2);
    s0 = math::div(s2, s2);
    s1 = math::cond(s1, s5, x[2]);
    s4 = math::mul(x[2], s0);
    s6 = math::log(x[3]);
    s4 = math::cond(s4, s1, s0);
    s4 = math::log(s4);
    s6 = math::exp(s6);
    s6 = math::mul(s6, x[2]);
    s2 = math::cos(s6);
    s3 = math::exp(s4);
    s3 = math::mul(x[2], s3);
    s0 = math::sub(s2, s3);
    s0 = math::cos(s0);
    s0
}

/// Program 23 -> action 0.
fn program_23(x: &Window) -> f32 {
    let mut s0 = -0.61039805;
    let mut s1 = 0.25427634;
    let mut s2 = 0.21520425;
    let mut s3 = -0.45112154;
    let mut s4 = 0.22923672;
    let mut s5 = -0.25884002;
    let mut s6 = 0.8296961;
    let mut s7 = 0.3470068;
    s2 = math::cond(s2, s0, s5);
    s2 = math::cond(s2, s6, s5);
    s7 = math::mul(s2, s2);
    s6 = math::log(x[3]);
    s2 = math::add(s4, x[0]);
    s6 = math::cond(s6, s2, s7);
    s1 = math::div(x[3], s0);
    s6 = math::log(s6);
    s2 = math::sub(s6, s1);
    s3 = math::add(s2, s2);
    s7 = math::sub(s4, s4);
    s0 = math::exp(s7);
    s2 = math::log(s4);
    s3 = math::log(s3);
    s0 = math::cond(s0, x[3], s3);
    s6 = math::mul(s0, s2);
    s2 = math::exp(s6);
    s4 = math::sub(s2, s0);
    s1 = math::sub(s4, x[2]);
    s7 = math::cos(s1);
    s0 = math::exp(s7);
    s0
}

/// Program 24 -> action 0.
fn program_24(x: &Window) -> f32 {
    let mut s0 = -0.5681167;
    let mut s1 = 0.08650851;
    let mut s2 = 0.9949541;
    let mut s3 = 0.94413555;
    let mut s4 = 0.49667233;
    let mut s5 = 0.17072009;
    let mut s6 = 0.98114973;
    let mut s7 = -0.72804636;
    s4 = math::div(s4, x[0]);
    s0 = math::sub(s2, s4);
    s2 = math::div(x[0], s1);
    s4 = math::log(s4);
    s4 = math::cond(s4, x[1], s0);
    s2 = math::add(s2, s2);
    s0 = math::exp(x[2]);
    s0 = math::cond(s0, s2, s4);
    s5 = math::mul(s0, x[2]);
    s5 = math::log(s5);
    s3 = math::cos(x[0]);
    s7 = math::exp(s5);
    s5 = math::div(x[1], s7);
    s6 = math::mul(s3, s5);
    s0 = math::sub(x[2], s6);
    s7 = math::exp(s0);
    s4 = math::sub(x[0], s7);
    s0 = math::cos(s4);
    s0
}

/// Program 25 -> action 1.
fn program_25(x: &Window) -> f32 {
    let mut s0 = -0.2503518;
    let mut s1 = 0.98037195;
    let mut s2 = -0.37419605;
    let mut s3 = -0.5678002;
    let mut s4 = 0.85134614;
    let mut s5 = -0.31319878;
    let mut s6 = -0.77283084;
    s5 = math::sub(s2, s5);
    s6 = math::add(s0, x[1]);
    s5 = math::cond(s5, x[3], s0);
    s5 = math::cond(s5, x[1], s1);
    s4 = math::cos(s1);
    s0 = math::add(x[1], s5);
    s6 = math::div(s6, s0);
    s0 = math::add(s4, s6);
    s1 = math::add(s0, s6);
    s1 = math::mul(s1, x[0]);
    s3 = math::add(s1, s0);
    s0 = math::mul(s3, x[1]);
    s6 = math::add(x[3], s0);
    s3 = math::exp(s6);
    s6 = math::mul(s3, s3);
    s1 = math::mul(s6, x[3]);
    s0 = math::sub(x[3], s1);
    s0 = math::cond(s0, x[3], s0);
    s0
}

/// Program 27 -> action 1.
fn program_27(x: &Window) -> f32 {
    let mut s0 = -0.9603313;
    let mut s1 = 0.7261717;
    let mut s2 = -0.27673128;
    let mut s3 = -0.080444716;
    let mut s4 = 0.23467351;
    let mut s5 = -0.3546437;
    let mut s6 = 0.8698025;
    let mut s7 = -0.6336677;
    s7 = math::div(s7, s5);
    s5 = math::exp(s7);
    s3 = math::div(s5, x[2]);
    s4 = math::exp(s3);
    s3 = math::sub(x[2], x[0]);
    s5 = math::div(s4, x[2]);
    s2 = math::add(s5, s5);
    s5 = math::cond(s5, x[1], x[3]);
    s6 = math::cos(s3);
    s6 = math::cond(s6, s4, s5);
    s7 = math::add(x[3], x[1]);
    s3 = math::log(s7);
    s5 = math::cond(s5, s3, s2);
    s6 = math::cond(s6, x[1], x[1]);
    s4 = math::exp(s5);
    s7 = math::cond(s7, s6, s4);
    s1 = math::mul(s7, s2);
    s0 = math::exp(s1);
    s0
}

/// Program 32 -> team 6.
fn program_32(x: &Window) -> f32 {
    let mut s0 = -0.626848;
    let mut s1 = 0.6663883;
    let mut s2 = -0.90044415;
    let mut s3 = 0.04430205;
    let mut s4 = -0.84700274;
    let mut s5 = -0.22019301;
    let mut s6 = 0.85712117;
    let mut s7 = -0.70008945;
    s3 = math::div(s1, s6);
    s6 = math::cos(x[2]);
    s2 = math::add(s3, s3);
    s4 = math::div(s2, s2);
    s1 = math::sub(x[1], s4);
    s1 = math::cond(s1, x[2], s1);
    s7 = math::add(x[0], s1);
    s3 = math::cos(x[1]);
    s1 = math::exp(s3);
    s3 = math::div(s6, s1);
    s4 = math::cos(s7);
    s6 = math::log(s3);
    s5 = math::sub(s6, s4);
    s7 = math::sub(s5, x[2]);
    s2 = math::log(s7);
    s5 = math::div(s7, s2);
    s0 = math::exp(s5);
    s0
}

/// Program 33 -> action 0.
fn program_33(x: &Window) -> f32 {
    let mut s0 = -0.29715547;
    let mut s1 = -0.15759751;
    let mut s2 = -0.76071745;
    let mut s3 = 0.13312747;
    let mut s4 = 0.5648786;
    let mut s5 = -0.6987616;
    let mut s6 = -0.09019734;
    let mut s7 = 0.5627911;
    s0 = math::mul(s2, s7);
    s6 = math::exp(x[0]);
    s1 = math::mul(x[2], x[3]);
    s0 = math::mul(s0, s6);
    s5 = math::div(x[3], s0);
    s4 = math::add(x[0], x[2]);
    s7 = math::cos(s0);
    s1 = math::log(s1);
    s2 = math::mul(s5, s0);
    s6 = math::mul(s5, s1);
    s1 = math::mul(s2, s5);
    s6 = math::cond(s6, s4, s6);
    s5 = math::add(s6, s7);
    s7 = math::mul(s1, x[0]);
    s4 = math::sub(x[2], x[2]);
    s0 = math::div(s4, s7);
    s0 = math::cond(s0, s5, s5);
    s0 = math::div(s0, x[3]);
    s3 = math::log(x[1]);
    s0 = math::add(s3, s0);
    s0
}

/// Program 34 -> action 1.
fn program_34(x: &Window) -> f32 {
    let mut s0 = -0.6813259;
    let mut s1 = 0.23344822;
    let mut s2 = -0.19455573;
    let mut s3 = -0.8367712;
    let mut s4 = -0.2660212;
    let mut s5 = 0.40514377;
    let mut s6 = -0.21476747;
    let mut s7 = 0.37353665;
    s6 = math::div(x[0], s5);
    s1 = math::add(s1, x[0]);
    s0 = math::div(x[2], x[3]);
    s1 = math::cond(s1, x[3], s0);
    s4 = math::cos(s1);
    s5 = math::sub(s4, s6);
    s4 = math::mul(s5, s6);
    s1 = math::sub(x[0], s4);
    s0 = math::mul(x[2], s4);
    s2 = math::div(s1, s4);
    s6 = math::exp(x[0]);
    s5 = math::add(s3, x[0]);
    s2 = math::cond(s2, s5, s6);
    s2 = math::cos(s2);
    s3 = math::exp(x[0]);
    s7 = math::add(s3, x[2]);
    s0 = math::div(s0, x[1]);
    s0 = math::cond(s0, s2, s7);
    s0
}

#[inline(always)]
fn vector(x: &Window, at: usize) -> Vector {
    x.get(at..).and_then(|x| x.first_chunk()).copied().unwrap_or([0.0; W])
}

#[inline(always)]
fn matrix(x: &Window, at: usize) -> Matrix {
    let rows = x.get(at..).map(|x| x.as_chunks().0).unwrap_or_default();
    rows.first_chunk().copied().unwrap_or([[0.0; W]; W])
}

#[inline(always)]
fn each_row(x: &Matrix, f: impl Fn(&Vector) -> Vector) -> Matrix {
    let mut out = *x;
    for row in &mut out {
        *row = f(row);
    }
    out
}

#[inline(always)]
fn fill_rows(x: &Vector, f: impl Fn(f32) -> Vector) -> Matrix {
    let mut out = [[0.0; W]; W];
    for (row, x) in out.iter_mut().zip(x) {
        *row = f(*x);
    }
    out
}
