//! A cue at the start, a question at the end.

use super::{LONGEST, PERIOD_US, chosen, index, number, step};
use crate::task::spec::round;
use crate::task::{ActionSpace, Rng, Spec, Step, Task};
use tpg_runtime::Action;

/// Most bits of a cue.
pub const MOST_BITS: u32 = 100;

/// Remembering one of several bits: bsuite's memory_len and memory_size.
///
/// The observation is the time left, which falls from 1 by 1 / length a step, the number of the bit that is asked for (0 but in the
/// last observation), and the bits as −1 or 1 (0 but at time 0, which is observed twice). The last of length + 1 steps earns 1 if
/// its action is the bit, 0 or 1, and costs 1 if it is not. All others earn nothing.
///
/// bsuite's score is the share of its lengths or sizes where more than 62.5 % of the answers are right, a mean return above 0.25.
#[derive(Debug, Clone)]
pub struct MemoryChain {
    spec: Spec,
    length: u32,
    bits: Vec<bool>,
    query: usize,
    /// Time that the last observation showed.
    shown: u32,
    steps: u32,
}

impl MemoryChain {
    /// memory_len: one bit over a length from 1 to 100 000. Others count as the nearest.
    #[must_use]
    pub fn with_length(length: u32) -> Self {
        let length = length.clamp(1, LONGEST);
        MemoryChain::of(format!("memory-len:{length}-v1"), length, 1)
    }

    /// memory_size: from 1 to 100 bits over a length of 2. Others count as the nearest.
    #[must_use]
    pub fn with_bits(bits: u32) -> Self {
        let bits = bits.clamp(1, MOST_BITS);
        MemoryChain::of(format!("memory-size:{bits}-v1"), 2, bits)
    }

    fn of(name: String, length: u32, bits: u32) -> Self {
        let mut inputs = vec![number("time_left"), number("query")];
        inputs.extend((0..bits).map(|k| number(format!("bit_{k}"))));
        MemoryChain {
            spec: Spec {
                name,
                inputs,
                outputs: vec![index("bit")],
                actions: ActionSpace::Discrete(2),
                max_steps: length + 1,
                period_us: PERIOD_US,
            },
            length,
            bits: vec![false; bits as usize],
            query: 0,
            shown: 0,
            steps: 0,
        }
    }

    /// Starts an episode with these bits and this question. Of another number of bits only the common part is taken.
    pub fn set_cue(&mut self, bits: &[bool], query: usize) {
        for (bit, given) in self.bits.iter_mut().zip(bits) {
            *bit = *given;
        }
        self.query = query;
        (self.shown, self.steps) = (0, 0);
    }
}

impl Task for MemoryChain {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        for bit in &mut self.bits {
            *bit = rng.chance(0.5);
        }
        self.query = rng.below(self.bits.len() as u64) as usize;
        (self.shown, self.steps) = (0, 0);
    }

    fn observe(&self, observation: &mut [f32]) {
        let time = 1.0 - f64::from(self.shown) / f64::from(self.length);
        let last = self.shown + 1 == self.length;
        let query = if last { self.query as f64 } else { 0.0 };
        let bit = |bit: &bool| match (self.shown, bit) {
            (0, true) => 1.0,
            (0, false) => -1.0,
            _ => 0.0,
        };
        let values = [round(time), round(query)];
        let values = values.into_iter().chain(self.bits.iter().map(bit));
        for (out, value) in observation.iter_mut().zip(values) {
            *out = value;
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        self.steps += 1;
        if self.steps <= self.length {
            // What a step shows is the time before it.
            self.shown = self.steps - 1;
            return step(0.0, false);
        }
        let bit = self.bits.get(self.query).copied().unwrap_or(false);
        let right = chosen(action) == u16::from(bit);
        step(if right { 1.0 } else { -1.0 }, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_remembers_the_bits_answers_right() {
        for mut task in [
            MemoryChain::with_length(1),
            MemoryChain::with_length(9),
            MemoryChain::with_bits(7),
        ] {
            let mut rng = Rng::new(6);
            for _ in 0..50 {
                task.reset(&mut rng);
                let mut observation = vec![0.0; task.spec().inputs.len()];
                task.observe(&mut observation);
                let bits = observation[2..].to_vec();
                for left in (1..=task.length).rev() {
                    let step = task.step(Action::Discrete(0));
                    assert_eq!(
                        (step.reward.to_bits(), step.terminated),
                        (0, false),
                        "{left}"
                    );
                }
                task.observe(&mut observation);
                let asked = observation[1] as usize;
                let step = task.step(Action::Discrete(u16::from(bits[asked] > 0.0)));
                assert_eq!(
                    (step.reward.to_bits(), step.terminated),
                    (1.0f64.to_bits(), true)
                );
            }
        }
    }
}
