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
        let mut visited_1 = false;
        let mut visited_2 = false;
        let mut visited_4 = false;
        let mut visited_5 = false;
        let mut visited_6 = false;
        let mut visited_7 = false;
        let (mut team, mut winner, mut instructions, mut teams) = (0u16, 0u16, 0u32, 0u16);
        for _ in 0..7 {
            teams += 1;
            let mut best = f32::NEG_INFINITY;
            team = match team {
                0 => {
                    instructions += 80;
                    let bid_0 = program_0(x);
                    if bid_0 > best { best = bid_0; winner = 0; }
                    let bid_1 = program_1(x);
                    if bid_1 > best { best = bid_1; winner = 1; }
                    let bid_2 = program_2(x);
                    if bid_2 > best { best = bid_2; winner = 2; }
                    let bid_3 = program_3(x);
                    if bid_3 > best { best = bid_3; winner = 3; }
                    match winner { 0 => 4, 1 => 1, 2 => 1, _ => break }
                }
                1 => {
                    visited_1 = true;
                    instructions += 42;
                    if !visited_6 {
                        instructions += 20;
                        let bid_4 = program_4(x);
                        if bid_4 > best { best = bid_4; winner = 4; }
                    }
                    if !visited_4 {
                        instructions += 22;
                        let bid_5 = program_5(x);
                        if bid_5 > best { best = bid_5; winner = 5; }
                    }
                    let bid_6 = program_6(x);
                    if bid_6 > best { best = bid_6; winner = 6; }
                    let bid_7 = program_7(x);
                    if bid_7 > best { best = bid_7; winner = 7; }
                    match winner { 4 => 6, 5 => 4, _ => break }
                }
                2 => {
                    visited_2 = true;
                    instructions += 17;
                    if !visited_1 {
                        instructions += 18;
                        let bid_8 = program_8(x);
                        if bid_8 > best { best = bid_8; winner = 8; }
                    }
                    if !visited_6 {
                        instructions += 21;
                        let bid_10 = program_10(x);
                        if bid_10 > best { best = bid_10; winner = 10; }
                    }
                    let bid_11 = program_11(x);
                    if bid_11 > best { best = bid_11; winner = 11; }
                    match winner { 8 => 1, 10 => 6, _ => break }
                }
                4 => {
                    visited_4 = true;
                    instructions += 21;
                    if !visited_6 {
                        instructions += 22;
                        let bid_16 = program_16(x);
                        if bid_16 > best { best = bid_16; winner = 16; }
                    }
                    if !visited_1 {
                        instructions += 19;
                        let bid_17 = program_17(x);
                        if bid_17 > best { best = bid_17; winner = 17; }
                    }
                    if !visited_7 {
                        instructions += 20;
                        let bid_18 = program_18(x);
                        if bid_18 > best { best = bid_18; winner = 18; }
                    }
                    let bid_19 = program_19(x);
                    if bid_19 > best { best = bid_19; winner = 19; }
                    match winner { 16 => 6, 17 => 1, 18 => 7, _ => break }
                }
                5 => {
                    visited_5 = true;
                    instructions += 61;
                    if !visited_2 {
                        instructions += 20;
                        let bid_20 = program_20(x);
                        if bid_20 > best { best = bid_20; winner = 20; }
                    }
                    let bid_21 = program_21(x);
                    if bid_21 > best { best = bid_21; winner = 21; }
                    let bid_22 = program_22(x);
                    if bid_22 > best { best = bid_22; winner = 22; }
                    let bid_23 = program_23(x);
                    if bid_23 > best { best = bid_23; winner = 23; }
                    match winner { 20 => 2, _ => break }
                }
                6 => {
                    visited_6 = true;
                    instructions += 54;
                    if !visited_2 {
                        instructions += 18;
                        let bid_24 = program_24(x);
                        if bid_24 > best { best = bid_24; winner = 24; }
                    }
                    let bid_25 = program_25(x);
                    if bid_25 > best { best = bid_25; winner = 25; }
                    let bid_26 = program_26(x);
                    if bid_26 > best { best = bid_26; winner = 26; }
                    let bid_27 = program_27(x);
                    if bid_27 > best { best = bid_27; winner = 27; }
                    match winner { 24 => 2, _ => break }
                }
                7 => {
                    visited_7 = true;
                    instructions += 40;
                    if !visited_1 {
                        instructions += 22;
                        let bid_28 = program_28(x);
                        if bid_28 > best { best = bid_28; winner = 28; }
                    }
                    let bid_29 = program_29(x);
                    if bid_29 > best { best = bid_29; winner = 29; }
                    if !visited_5 {
                        instructions += 22;
                        let bid_30 = program_30(x);
                        if bid_30 > best { best = bid_30; winner = 30; }
                    }
                    let bid_31 = program_31(x);
                    if bid_31 > best { best = bid_31; winner = 31; }
                    match winner { 28 => 1, 30 => 5, _ => break }
                }
                _ => break,
            };
        }
        let action = match winner { 22 => 1, 25 => 1, 26 => 1, 29 => 1, 3 => 1, 7 => 1, _ => 0 };
        Decision { action, winner, instructions, teams }
    }
}

/// Program 0 -> team 4.
fn program_0(x: &Window) -> f32 {
    let mut s0 = 0.0450273;
    let mut s1 = -0.45069182;
    let mut s2 = -0.7480811;
    let mut s3 = 0.55905795;
    let mut s4 = -0.90267587;
    let mut s5 = -0.83576035;
    let mut s6 = 0.9832557;
    let mut s7 = 0.81257606;
    s4 = math::sub(x[2], s1);
    s0 = math::add(s3, s7);
    s1 = math::max(s5, s6);
    s6 = math::max(s3, s2);
    s5 = math::mul(s4, s6);
    s7 = math::add(s1, s0);
    s1 = math::min(s7, s5);
    s4 = math::min(s2, s1);
    s5 = math::div(s4, x[1]);
    s1 = math::mul(x[2], x[1]);
    s2 = math::mul(s6, x[2]);
    s6 = math::mul(x[1], s6);
    s7 = math::add(x[0], s2);
    s3 = math::div(s5, s3);
    s2 = math::add(s1, s1);
    s5 = math::add(s7, s2);
    s1 = math::sub(x[1], s2);
    s5 = math::min(s5, s1);
    s2 = math::sub(s5, s6);
    s1 = math::mul(s2, s3);
    s0 = math::mul(x[3], s1);
    s0
}

/// Program 1 -> team 1.
fn program_1(x: &Window) -> f32 {
    let mut s0 = -0.6104431;
    let mut s1 = -0.78782815;
    let mut s2 = 0.5103444;
    let mut s3 = -0.6237091;
    let mut s4 = -0.42700982;
    let mut s5 = -0.8103389;
    let mut s6 = -0.15389645;
    let mut s7 = 0.19910046;
    s3 = math::add(x[2], s5);
    s5 = math::mul(s0, x[2]);
    s1 = math::mul(s2, x[3]);
    s4 = math::add(s1, s5);
    s4 = math::mul(s4, x[1]);
    s6 = math::min(s4, s4);
    s0 = math::div(s3, s4);
    s2 = math::max(s6, s6);
    s1 = math::sub(s2, x[2]);
    s2 = math::max(x[0], x[2]);
    s7 = math::sub(s0, x[1]);
    s6 = math::sub(x[0], x[3]);
    s6 = math::min(s1, s6);
    s4 = math::div(s6, s2);
    s1 = math::add(s1, s4);
    s6 = math::sub(x[1], s1);
    s3 = math::div(x[3], s6);
    s2 = math::max(s7, x[1]);
    s0 = math::min(s3, x[1]);
    s3 = math::add(s0, x[0]);
    s6 = math::div(s3, s2);
    s0 = math::min(s6, s1);
    s0
}

/// Program 2 -> team 1.
fn program_2(x: &Window) -> f32 {
    let mut s0 = -0.53576314;
    let mut s1 = -0.93097913;
    let mut s2 = -0.51436317;
    let mut s3 = -0.49825644;
    let mut s4 = 0.8018999;
    let mut s5 = -0.92167366;
    let mut s6 = 0.41697222;
    let mut s7 = 0.20003675;
    s4 = math::add(s4, s2);
    s1 = math::sub(s3, s4);
    s3 = math::max(s6, s1);
    s5 = math::max(s1, s2);
    s7 = math::min(s3, s5);
    s0 = math::add(x[3], s2);
    s1 = math::mul(s7, s0);
    s5 = math::min(s1, s0);
    s3 = math::min(s5, s1);
    s1 = math::mul(s0, s0);
    s5 = math::sub(s1, x[1]);
    s0 = math::div(s0, s3);
    s2 = math::min(s0, s5);
    s4 = math::div(x[0], s0);
    s6 = math::add(s0, s4);
    s6 = math::sub(s6, s6);
    s3 = math::mul(s0, s6);
    s6 = math::max(x[0], s3);
    s6 = math::sub(s3, s6);
    s0 = math::add(s2, s6);
    s0
}

/// Program 3 -> action 1.
fn program_3(x: &Window) -> f32 {
    let mut s0 = -0.8672747;
    let mut s1 = -0.5072683;
    let mut s2 = 0.9202574;
    let mut s3 = 0.50218636;
    let mut s4 = -0.9315188;
    let mut s6 = 0.8969268;
    let mut s7 = -0.05614326;
    s2 = math::max(s3, s0);
    s0 = math::add(s7, s0);
    s3 = math::mul(s2, s2);
    s2 = math::div(s0, s3);
    s7 = math::div(x[0], s2);
    s6 = math::sub(s0, s2);
    s1 = math::mul(s7, s0);
    s3 = math::min(s1, s3);
    s0 = math::min(s1, x[1]);
    s4 = math::mul(x[3], s3);
    s7 = math::min(s6, s4);
    s6 = math::add(x[3], x[0]);
    s1 = math::max(s0, s6);
    s1 = math::max(s7, s1);
    s2 = math::div(s1, s2);
    s1 = math::div(s2, x[3]);
    s0 = math::min(x[2], s1);
    s0
}

/// Program 4 -> team 6.
fn program_4(x: &Window) -> f32 {
    let mut s0 = 0.010772966;
    let mut s1 = 0.13090858;
    let mut s2 = -0.06518781;
    let mut s3 = 0.13792944;
    let mut s4 = 0.33216915;
    let mut s5 = -0.030250534;
    let mut s6 = -0.17383513;
    let mut s7 = -0.42530483;
    s2 = math::add(x[0], x[3]);
    s7 = math::max(s5, x[3]);
    s3 = math::max(s3, s7);
    s7 = math::div(s2, x[0]);
    s5 = math::div(s3, x[1]);
    s0 = math::div(x[3], x[0]);
    s0 = math::max(s0, s7);
    s0 = math::max(s0, x[1]);
    s1 = math::add(s5, x[3]);
    s2 = math::mul(x[2], s0);
    s4 = math::add(s2, x[1]);
    s2 = math::min(s4, x[1]);
    s4 = math::div(s2, x[2]);
    s6 = math::mul(s1, x[2]);
    s0 = math::sub(s4, s2);
    s3 = math::add(s6, s0);
    s4 = math::add(x[1], s3);
    s1 = math::min(x[0], x[0]);
    s0 = math::add(s1, x[3]);
    s0 = math::min(s4, s0);
    s0
}

/// Program 5 -> team 4.
fn program_5(x: &Window) -> f32 {
    let mut s0 = 0.6142741;
    let mut s1 = 0.09171469;
    let mut s2 = -0.12720679;
    let mut s3 = -0.34397507;
    let mut s4 = -0.26580277;
    let mut s5 = -0.13101025;
    let mut s6 = -0.07121671;
    let mut s7 = -0.697701;
    s2 = math::div(s3, s7);
    s4 = math::mul(s4, s2);
    s2 = math::add(s4, x[3]);
    s4 = math::div(s5, s2);
    s6 = math::sub(x[3], s6);
    s2 = math::div(s7, s6);
    s0 = math::sub(s4, s2);
    s7 = math::add(s7, s1);
    s7 = math::div(s7, x[1]);
    s5 = math::mul(s4, s7);
    s6 = math::mul(s6, s5);
    s6 = math::div(s0, s6);
    s7 = math::mul(x[3], x[1]);
    s3 = math::add(x[1], x[0]);
    s0 = math::mul(s6, s7);
    s7 = math::mul(s3, x[2]);
    s0 = math::div(s0, s3);
    s1 = math::max(s0, s7);
    s6 = math::add(s1, x[2]);
    s2 = math::div(x[3], s6);
    s4 = math::add(s2, s2);
    s0 = math::min(s4, x[0]);
    s0
}

/// Program 6 -> action 0.
fn program_6(x: &Window) -> f32 {
    let mut s0 = -0.86536175;
    let mut s1 = 0.50068253;
    let mut s2 = -0.9131337;
    let mut s3 = -0.40560937;
    let mut s4 = -0.67300034;
    let mut s5 = -0.8760244;
    let mut s6 = -0.30606595;
    let mut s7 = -0.09298905;
    s3 = math::div(s7, s5);
    s5 = math::mul(s3, s1);
    s7 = math::add(s7, x[1]);
    s6 = math::sub(s4, s7);
    s0 = math::mul(x[1], s1);
    s3 = math::max(s2, s7);
    s6 = math::sub(s5, s6);
    s5 = math::max(s7, s7);
    s1 = math::min(s3, s7);
    s4 = math::mul(s5, s7);
    s3 = math::min(x[3], s1);
    s4 = math::max(s4, s3);
    s1 = math::div(s4, s3);
    s3 = math::mul(s1, x[1]);
    s0 = math::sub(x[3], s0);
    s2 = math::min(s3, s6);
    s0 = math::min(s0, s6);
    s3 = math::add(x[1], s0);
    s6 = math::add(s2, s2);
    s4 = math::sub(s6, s3);
    s3 = math::mul(s4, x[2]);
    s0 = math::div(s4, s3);
    s0
}

/// Program 7 -> action 1.
fn program_7(x: &Window) -> f32 {
    let mut s0 = 0.14532474;
    let mut s1 = -0.8086476;
    let mut s2 = -0.5647284;
    let mut s3 = 0.823391;
    let mut s4 = -0.06321266;
    let mut s5 = -0.25845966;
    let mut s6 = 0.898613;
    let mut s7 = -0.44264615;
    s5 = math::div(x[2], s7);
    s2 = math::min(x[3], s5);
    s6 = math::sub(s1, s3);
    s1 = math::add(s4, s2);
    s4 = math::min(s1, x[2]);
    s2 = math::mul(s4, x[2]);
    s7 = math::sub(s4, s6);
    s1 = math::mul(s4, s7);
    s4 = math::max(x[0], s4);
    s0 = math::min(x[3], s4);
    s6 = math::add(s2, s1);
    s2 = math::min(s6, s0);
    s4 = math::max(x[0], x[0]);
    s3 = math::mul(s4, x[2]);
    s0 = math::min(s2, x[0]);
    s4 = math::mul(s3, s0);
    s4 = math::mul(s0, s4);
    s7 = math::div(s0, s4);
    s6 = math::mul(s3, s7);
    s0 = math::add(s6, x[0]);
    s0
}

/// Program 8 -> team 1.
fn program_8(x: &Window) -> f32 {
    let mut s0 = 0.35332188;
    let mut s1 = -0.6318705;
    let mut s2 = 0.59180075;
    let mut s3 = 0.49156046;
    let mut s4 = 0.32462248;
    let mut s5 = -0.71261084;
    let mut s6 = 0.39866972;
    let mut s7 = -0.8181058;
    s6 = math::mul(x[0], s3);
    s1 = math::max(s6, x[0]);
    s4 = math::div(s6, x[1]);
    s6 = math::sub(s1, s4);
    s3 = math::div(s4, x[3]);
    s7 = math::mul(s6, s4);
    s6 = math::sub(x[3], s7);
    s7 = math::mul(s6, s3);
    s2 = math::sub(s7, s7);
    s0 = math::min(s2, s7);
    s2 = math::mul(s2, s1);
    s7 = math::add(s2, s1);
    s6 = math::min(s7, s0);
    s5 = math::min(x[0], x[2]);
    s2 = math::mul(s5, s1);
    s0 = math::max(s2, s6);
    s5 = math::min(s0, s0);
    s0 = math::div(s5, x[3]);
    s0
}

/// Program 10 -> team 6.
fn program_10(x: &Window) -> f32 {
    let mut s0 = -0.6079567;
    let mut s1 = -0.62513435;
    let mut s2 = 0.87123126;
    let mut s3 = 0.93868196;
    let mut s4 = 0.4249635;
    let mut s5 = 0.44224507;
    let mut s6 = 0.30003127;
    let mut s7 = 0.50565237;
    s0 = math::add(s6, s1);
    s2 = math::sub(s2, x[3]);
    s3 = math::div(s0, s5);
    s7 = math::sub(s2, s3);
    s2 = math::mul(x[3], x[1]);
    s6 = math::div(x[0], s2);
    s1 = math::max(x[0], s7);
    s4 = math::mul(x[1], s6);
    s7 = math::max(x[1], s4);
    s5 = math::min(s1, x[0]);
    s4 = math::div(s6, s5);
    s3 = math::add(s2, s7);
    s0 = math::sub(s4, s3);
    s3 = math::div(x[0], x[3]);
    s6 = math::mul(s3, s0);
    s4 = math::add(s6, s0);
    s3 = math::add(x[3], x[1]);
    s6 = math::min(x[0], x[1]);
    s2 = math::add(s3, s6);
    s6 = math::mul(s2, s4);
    s0 = math::min(s6, s3);
    s0
}

/// Program 11 -> action 0.
fn program_11(x: &Window) -> f32 {
    let mut s0 = -0.2373437;
    let mut s1 = 0.25410026;
    let mut s2 = 0.46470493;
    let mut s3 = 0.9905908;
    let mut s4 = -0.4374605;
    let mut s5 = -0.6082248;
    let mut s6 = -0.6036053;
    let mut s7 = -0.88349026;
    s7 = math::div(s6, s0);
    s6 = math::div(s7, x[0]);
    s2 = math::sub(s6, x[1]);
    s5 = math::add(s6, s2);
    s7 = math::min(x[1], s2);
    s2 = math::mul(x[0], x[1]);
    s4 = math::sub(s7, s7);
    s0 = math::max(s5, s4);
    s3 = math::add(s0, s2);
    s7 = math::sub(s2, s4);
    s1 = math::sub(s4, s3);
    s2 = math::mul(x[3], s1);
    s1 = math::div(s7, s7);
    s0 = math::sub(s1, s2);
    s6 = math::max(s0, x[2]);
    s5 = math::add(x[1], s6);
    s0 = math::min(s5, x[3]);
    s0
}

/// Program 16 -> team 6.
fn program_16(x: &Window) -> f32 {
    let mut s0 = 0.35603282;
    let mut s1 = -0.41331735;
    let mut s2 = 0.3426496;
    let mut s3 = 0.9083206;
    let mut s4 = -0.36950326;
    let mut s5 = 0.110944025;
    let mut s6 = 0.7597352;
    let mut s7 = -0.68471324;
    s0 = math::max(s1, x[1]);
    s4 = math::min(s7, s1);
    s4 = math::add(s4, s5);
    s6 = math::min(s4, x[0]);
    s1 = math::max(s5, s0);
    s4 = math::max(s6, s6);
    s6 = math::div(s4, s0);
    s7 = math::mul(s1, x[3]);
    s4 = math::sub(x[0], s7);
    s7 = math::div(s6, x[0]);
    s2 = math::add(s2, s6);
    s0 = math::add(s7, s4);
    s4 = math::div(s7, s2);
    s7 = math::div(s2, s2);
    s7 = math::max(s4, s7);
    s2 = math::min(s2, x[0]);
    s3 = math::min(s7, s7);
    s4 = math::div(s2, x[2]);
    s3 = math::min(s3, s0);
    s5 = math::add(s7, x[3]);
    s5 = math::max(s3, s5);
    s0 = math::mul(s5, s4);
    s0
}

/// Program 17 -> team 1.
fn program_17(x: &Window) -> f32 {
    let mut s0 = 0.18899661;
    let mut s1 = 0.62334436;
    let mut s2 = 0.26640403;
    let mut s3 = 0.29802442;
    let mut s4 = 0.98089606;
    let mut s5 = -0.3847436;
    let mut s6 = 0.84303576;
    let mut s7 = -0.8775011;
    s0 = math::mul(s3, s1);
    s6 = math::min(x[0], s0);
    s7 = math::max(x[2], x[1]);
    s3 = math::min(s6, s7);
    s6 = math::sub(s3, x[0]);
    s3 = math::mul(x[0], s6);
    s1 = math::min(x[3], s3);
    s6 = math::add(s1, x[1]);
    s4 = math::mul(s3, s3);
    s3 = math::div(x[3], s4);
    s7 = math::div(s3, s6);
    s5 = math::min(x[1], s7);
    s2 = math::mul(x[0], s5);
    s1 = math::add(x[3], s2);
    s5 = math::mul(s1, s1);
    s1 = math::max(x[3], s5);
    s2 = math::sub(s1, s1);
    s4 = math::mul(x[2], x[0]);
    s0 = math::add(s2, s4);
    s0
}

/// Program 18 -> team 7.
fn program_18(x: &Window) -> f32 {
    let mut s0 = 0.2585935;
    let mut s1 = 0.6322347;
    let mut s2 = 0.15172797;
    let mut s3 = -0.07237746;
    let mut s4 = 0.9568003;
    let mut s5 = 0.746723;
    let mut s6 = -0.6473354;
    let mut s7 = -0.91680133;
    s0 = math::min(s2, s4);
    s4 = math::div(x[1], s0);
    s3 = math::add(x[0], x[2]);
    s1 = math::min(s3, x[1]);
    s6 = math::sub(x[1], s4);
    s7 = math::div(x[2], s1);
    s3 = math::div(s7, s6);
    s6 = math::add(x[2], s3);
    s3 = math::mul(x[2], s1);
    s7 = math::sub(s6, x[3]);
    s1 = math::mul(x[0], x[1]);
    s2 = math::div(s7, x[3]);
    s5 = math::add(x[0], x[2]);
    s6 = math::min(s1, s2);
    s0 = math::mul(s5, s5);
    s7 = math::max(s3, s6);
    s7 = math::div(s7, s4);
    s1 = math::min(s0, x[2]);
    s0 = math::min(s1, s1);
    s0 = math::max(s7, s0);
    s0
}

/// Program 19 -> action 0.
fn program_19(x: &Window) -> f32 {
    let mut s0 = 0.36564076;
    let mut s1 = 0.43458703;
    let mut s2 = 0.48370448;
    let mut s3 = -0.46090004;
    let mut s4 = -0.38073412;
    let mut s5 = 0.9522026;
    let mut s6 = 0.7776071;
    let mut s7 = 0.6131006;
    s1 = math::mul(x[3], s5);
    s5 = math::mul(s1, s4);
    s7 = math::sub(x[0], x[3]);
    s7 = math::div(x[0], s7);
    s1 = math::min(s7, x[3]);
    s1 = math::max(s5, s1);
    s3 = math::max(s1, x[0]);
    s6 = math::sub(s3, s3);
    s0 = math::max(x[1], x[1]);
    s0 = math::mul(s6, s0);
    s3 = math::sub(x[1], s6);
    s7 = math::max(s3, s0);
    s1 = math::mul(x[0], x[0]);
    s6 = math::mul(s1, x[2]);
    s2 = math::add(x[1], x[1]);
    s4 = math::sub(s7, s2);
    s7 = math::sub(x[1], s6);
    s7 = math::sub(s7, s7);
    s2 = math::div(s4, s7);
    s3 = math::mul(x[3], s2);
    s0 = math::max(s7, s3);
    s0
}

/// Program 20 -> team 2.
fn program_20(x: &Window) -> f32 {
    let mut s0 = 0.7395734;
    let mut s1 = 0.96946186;
    let mut s2 = -0.22051843;
    let mut s3 = 0.440514;
    let mut s4 = 0.82835454;
    let mut s5 = 0.76272464;
    let mut s6 = -0.9822256;
    let mut s7 = 0.42328614;
    s2 = math::mul(s4, x[3]);
    s7 = math::min(x[2], s2);
    s7 = math::sub(x[2], s7);
    s0 = math::max(x[2], s5);
    s1 = math::min(s2, s3);
    s6 = math::add(s0, s7);
    s5 = math::min(x[2], x[1]);
    s4 = math::min(s5, s6);
    s1 = math::div(x[3], s1);
    s7 = math::div(s4, s0);
    s6 = math::add(s7, s3);
    s2 = math::div(s6, s1);
    s6 = math::mul(s2, x[1]);
    s7 = math::sub(x[2], s1);
    s2 = math::add(s6, s7);
    s7 = math::max(s6, x[1]);
    s3 = math::max(x[0], s2);
    s4 = math::mul(x[2], s7);
    s7 = math::sub(s3, x[2]);
    s0 = math::add(s4, s7);
    s0
}

/// Program 21 -> action 0.
fn program_21(x: &Window) -> f32 {
    let mut s0 = 0.4717354;
    let mut s1 = 0.2768832;
    let mut s2 = -0.9281795;
    let mut s3 = -0.023994192;
    let mut s4 = -0.8334817;
    let mut s5 = -0.15507928;
    let mut s6 = 0.5522144;
    let mut s7 = 0.9952332;
    s2 = math::max(s2, s0);
    s4 = math::div(s2, x[3]);
    s3 = math::div(s4, s1);
    s7 = math::div(x[3], s3);
    s5 = math::min(s7, s4);
    s5 = math::mul(x[0], s5);
    s4 = math::min(x[3], s1);
    s0 = math::max(s4, s7);
    s1 = math::max(x[2], s5);
    s5 = math::min(s0, x[2]);
    s5 = math::mul(s5, s4);
    s3 = math::max(x[0], s1);
    s1 = math::add(s5, x[3]);
    s6 = math::mul(s1, s3);
    s2 = math::sub(s6, x[1]);
    s7 = math::add(x[1], x[3]);
    s6 = math::max(s2, s2);
    s7 = math::div(s6, s7);
    s7 = math::mul(x[1], s7);
    s4 = math::mul(x[0], s7);
    s1 = math::min(s7, s4);
    s0 = math::min(s1, x[1]);
    s0
}

/// Program 22 -> action 1.
fn program_22(x: &Window) -> f32 {
    let mut s0 = 0.17060223;
    let mut s1 = -0.1712088;
    let mut s2 = -0.14937566;
    let mut s3 = -0.75328684;
    let mut s4 = -0.5092675;
    let mut s5 = -0.3550827;
    let mut s6 = -0.17498642;
    let mut s7 = 0.64362663;
    s6 = math::min(s7, x[0]);
    s5 = math::div(s6, s4);
    s3 = math::div(s2, s5);
    s5 = math::add(s0, s7);
    s7 = math::sub(s3, x[1]);
    s6 = math::div(s7, s4);
    s7 = math::sub(s5, s1);
    s6 = math::max(s6, s6);
    s6 = math::mul(s4, s6);
    s3 = math::min(s1, s6);
    s7 = math::div(x[3], s7);
    s2 = math::add(s7, x[0]);
    s7 = math::sub(s2, s3);
    s3 = math::add(x[3], s7);
    s0 = math::div(x[2], s7);
    s1 = math::div(x[0], s3);
    s6 = math::div(s1, s1);
    s2 = math::div(s0, s6);
    s0 = math::sub(s2, x[2]);
    s0
}

/// Program 23 -> action 0.
fn program_23(x: &Window) -> f32 {
    let mut s0 = 0.60635847;
    let mut s1 = 0.157204;
    let mut s2 = 0.4875212;
    let mut s3 = 0.57715654;
    let mut s4 = -0.26830468;
    let mut s5 = 0.6022308;
    let mut s6 = -0.11114973;
    let mut s7 = -0.610419;
    s2 = math::mul(s5, s0);
    s3 = math::mul(s5, s5);
    s4 = math::add(s0, s5);
    s6 = math::min(x[0], s3);
    s3 = math::mul(s6, x[3]);
    s5 = math::max(s4, s2);
    s1 = math::div(s3, s3);
    s4 = math::min(s4, s1);
    s7 = math::add(s5, s6);
    s3 = math::mul(s7, s4);
    s7 = math::div(s3, x[1]);
    s6 = math::sub(s3, x[2]);
    s5 = math::max(x[0], s6);
    s0 = math::mul(s7, s5);
    s7 = math::add(x[2], x[0]);
    s7 = math::mul(s7, s0);
    s6 = math::div(x[2], x[2]);
    s4 = math::sub(s6, x[0]);
    s1 = math::min(s4, s7);
    s0 = math::min(x[1], s1);
    s0
}

/// Program 24 -> team 2.
fn program_24(x: &Window) -> f32 {
    let mut s0 = 0.6195692;
    let mut s1 = -0.7236855;
    let mut s2 = -0.6712537;
    let mut s3 = -0.37857607;
    let mut s4 = -0.09576231;
    let mut s5 = 0.10318298;
    let mut s6 = -0.9484697;
    let mut s7 = -0.34625855;
    s4 = math::div(s6, s2);
    s3 = math::max(s0, s2);
    s2 = math::add(s5, s3);
    s1 = math::min(x[0], s4);
    s2 = math::mul(s2, s1);
    s5 = math::mul(s2, s0);
    s4 = math::div(s5, s5);
    s7 = math::add(s4, x[2]);
    s5 = math::min(s4, s4);
    s2 = math::sub(x[1], x[1]);
    s4 = math::add(x[3], s7);
    s3 = math::min(x[0], s2);
    s7 = math::max(s7, x[2]);
    s7 = math::mul(s7, s5);
    s3 = math::min(s7, s3);
    s1 = math::add(x[1], s3);
    s4 = math::sub(s4, s1);
    s0 = math::min(s4, s1);
    s0
}

/// Program 25 -> action 1.
fn program_25(x: &Window) -> f32 {
    let mut s0 = -0.32443672;
    let mut s1 = 0.02022769;
    let mut s2 = -0.6726629;
    let mut s3 = 0.49132603;
    let mut s4 = 0.83723813;
    let mut s5 = 0.21273258;
    let mut s6 = 0.3080582;
    let mut s7 = 0.54478747;
    s3 = math::add(s3, x[1]);
    s2 = math::div(x[3], s3);
    s4 = math::mul(x[3], s3);
    s6 = math::div(x[1], s4);
    s7 = math::max(s2, x[0]);
    s2 = math::div(s4, s1);
    s6 = math::sub(s6, s7);
    s7 = math::max(x[0], x[0]);
    s1 = math::add(s2, s2);
    s1 = math::sub(s1, s7);
    s0 = math::max(s1, s6);
    s3 = math::max(s1, s0);
    s3 = math::min(s0, s3);
    s0 = math::add(s3, s3);
    s5 = math::max(x[2], x[3]);
    s2 = math::div(s5, s0);
    s0 = math::add(s2, s2);
    s0
}

/// Program 26 -> action 1.
fn program_26(x: &Window) -> f32 {
    let mut s0 = 0.6564311;
    let mut s1 = -0.56401813;
    let mut s2 = 0.52073634;
    let mut s3 = 0.26318443;
    let mut s4 = 0.18921933;
    let mut s5 = -0.42348385;
    let mut s6 = -0.29225758;
    let mut s7 = 0.44056693;
    s0 = math::max(s6, s2);
    s5 = math::add(s0, x[3]);
    s3 = math::add(x[1], s3);
    s1 = math::div(x[0], s0);
    s2 = math::add(s5, s3);
    s0 = math::mul(s5, x[2]);
    s7 = math::sub(s0, s5);
    s4 = math::max(x[2], s2);
    s6 = math::max(s7, s7);
    s0 = math::sub(s6, s4);
    s5 = math::add(s6, s1);
    s6 = math::mul(x[2], s5);
    s3 = math::mul(s0, s2);
    s7 = math::add(s6, x[3]);
    s5 = math::add(x[1], s6);
    s2 = math::add(s5, s3);
    s3 = math::max(s7, s6);
    s6 = math::sub(s2, s3);
    s0 = math::sub(s6, s3);
    s0
}

/// Program 27 -> action 0.
fn program_27(x: &Window) -> f32 {
    let mut s0 = 0.9930941;
    let mut s1 = 0.5495975;
    let mut s2 = 0.4112391;
    let mut s3 = 0.7926498;
    let mut s4 = -0.44729185;
    let mut s5 = 0.8304327;
    let mut s6 = -0.6747349;
    let mut s7 = 0.3524672;
    s2 = math::max(s1, s1);
    s7 = math::mul(s3, x[0]);
    s5 = math::add(s7, s2);
    s0 = math::sub(s5, x[0]);
    s2 = math::add(x[2], s0);
    s1 = math::sub(s5, x[3]);
    s4 = math::div(x[2], x[2]);
    s6 = math::div(s1, s4);
    s0 = math::max(s2, s6);
    s1 = math::div(x[0], s0);
    s5 = math::max(s0, s1);
    s4 = math::div(x[0], s5);
    s3 = math::sub(x[1], s4);
    s5 = math::add(s3, s1);
    s0 = math::add(x[1], s5);
    s4 = math::mul(s0, s0);
    s5 = math::mul(x[0], s4);
    s0 = math::div(s5, s4);
    s0
}

/// Program 28 -> team 1.
fn program_28(x: &Window) -> f32 {
    let mut s0 = -0.34085652;
    let mut s1 = 0.055041753;
    let mut s2 = -0.24721718;
    let mut s3 = 0.061983828;
    let mut s4 = -0.3327208;
    let mut s5 = -0.8204036;
    let mut s6 = -0.091837734;
    let mut s7 = 0.0008039731;
    s3 = math::sub(s6, x[0]);
    s2 = math::mul(s5, s6);
    s4 = math::div(s3, s3);
    s5 = math::sub(s6, s4);
    s3 = math::div(s5, s2);
    s6 = math::max(x[3], x[0]);
    s0 = math::max(s3, x[2]);
    s2 = math::div(s6, x[0]);
    s1 = math::div(s0, s2);
    s5 = math::min(s3, x[2]);
    s5 = math::div(x[0], s5);
    s2 = math::add(s5, s5);
    s5 = math::div(s2, x[3]);
    s0 = math::mul(s1, x[1]);
    s1 = math::add(s5, x[2]);
    s0 = math::mul(s1, s0);
    s7 = math::div(x[2], x[2]);
    s1 = math::add(s5, x[3]);
    s4 = math::mul(s7, x[2]);
    s0 = math::sub(s0, s1);
    s6 = math::sub(s0, s4);
    s0 = math::add(s6, s0);
    s0
}

/// Program 29 -> action 1.
fn program_29(x: &Window) -> f32 {
    let mut s0 = -0.31539977;
    let mut s1 = -0.1831553;
    let mut s2 = -0.049200267;
    let mut s3 = -0.81519365;
    let mut s4 = 0.36048222;
    let mut s5 = -0.17880808;
    let mut s6 = -0.566849;
    let mut s7 = 0.9937968;
    s1 = math::mul(s6, x[0]);
    s7 = math::max(s7, s4);
    s5 = math::min(x[3], s3);
    s4 = math::add(x[1], x[1]);
    s1 = math::min(s4, s1);
    s2 = math::div(s5, s1);
    s5 = math::sub(x[0], s7);
    s0 = math::add(s7, s7);
    s7 = math::min(x[1], s0);
    s5 = math::min(s5, x[1]);
    s4 = math::max(s5, s2);
    s5 = math::min(s7, s7);
    s5 = math::sub(s5, s4);
    s5 = math::sub(x[1], s5);
    s2 = math::sub(s5, x[3]);
    s0 = math::min(x[3], s2);
    s3 = math::max(s0, x[2]);
    s0 = math::div(s3, x[0]);
    s0
}

/// Program 30 -> team 5.
fn program_30(x: &Window) -> f32 {
    let mut s0 = 0.55294716;
    let mut s1 = 0.18803723;
    let mut s2 = -0.8029841;
    let mut s3 = 0.76307863;
    let mut s4 = -0.73914474;
    let mut s5 = 0.97788316;
    let mut s6 = -0.38815948;
    let mut s7 = 0.66324407;
    s0 = math::mul(x[0], x[1]);
    s1 = math::sub(s0, s1);
    s6 = math::max(s1, s0);
    s0 = math::div(x[1], x[1]);
    s5 = math::mul(x[0], s0);
    s7 = math::min(s6, s5);
    s3 = math::mul(x[3], s7);
    s7 = math::mul(x[3], s3);
    s0 = math::add(s7, x[1]);
    s7 = math::div(x[1], x[0]);
    s6 = math::sub(s0, s7);
    s0 = math::add(s7, s6);
    s7 = math::div(x[0], s0);
    s2 = math::div(x[2], x[2]);
    s3 = math::add(s7, s2);
    s7 = math::div(s3, x[1]);
    s4 = math::sub(s7, x[3]);
    s4 = math::add(s4, x[3]);
    s0 = math::sub(x[1], x[2]);
    s5 = math::div(s0, s0);
    s5 = math::min(s5, s4);
    s0 = math::min(s5, s5);
    s0
}

/// Program 31 -> action 0.
fn program_31(x: &Window) -> f32 {
    let mut s0 = 0.17228211;
    let mut s1 = -0.4138853;
    let mut s2 = 0.7033218;
    let mut s3 = 0.97061676;
    let mut s4 = 0.0664122;
    let mut s5 = 0.598633;
    let mut s6 = -0.18475778;
    let mut s7 = 0.46419317;
    s5 = math::div(s4, s0);
    s2 = math::max(x[2], s5);
    s3 = math::max(s7, s4);
    s6 = math::min(s7, s2);
    s3 = math::add(s3, s6);
    s5 = math::add(x[2], s3);
    s6 = math::add(s2, x[2]);
    s3 = math::min(s6, x[2]);
    s0 = math::add(s6, s3);
    s3 = math::div(x[3], s6);
    s0 = math::add(s0, s3);
    s1 = math::div(s5, s2);
    s4 = math::min(s1, x[0]);
    s2 = math::div(s0, s4);
    s3 = math::sub(s0, x[2]);
    s4 = math::mul(s3, s2);
    s7 = math::max(s1, s4);
    s4 = math::div(s2, s7);
    s5 = math::sub(x[2], s4);
    s2 = math::div(s7, s5);
    s1 = math::div(x[0], x[0]);
    s0 = math::div(s1, s2);
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
