//! Applies a stack of observabilities to observations.

use super::observability::{Observability, ObservabilityError, threshold};
use super::{Channel, Rng, Spec};

/// What stands for an element that a policy does not see. Policies of versions 1 and 2 of the file format take it for 0.
pub const MISSING: f32 = f32::NAN;

/// A stack of observabilities, ready to be applied to a task's observations.
#[derive(Debug, Clone)]
pub struct Wrappers {
    inputs: Vec<Channel>,
    /// For each input that is left, its index in the full observation.
    kept: Vec<usize>,
    /// For each blackout, the words that stand for it: those below the threshold.
    thresholds: Vec<u128>,
    /// The same in the stage of a curriculum that training is in.
    eased: Vec<u128>,
}

impl Wrappers {
    /// Prepares a stack for a task, the first element applied first.
    ///
    /// # Errors
    /// [`ObservabilityError::NothingToRemove`] if there are no velocities to remove or nothing else than velocities,
    /// [`ObservabilityError::NotAProbability`] if a blackout's fraction is not within 0 and 1.
    pub fn new(list: &[Observability], spec: &Spec) -> Result<Self, ObservabilityError> {
        let mut kept: Vec<usize> = (0..spec.inputs.len()).collect();
        let mut thresholds = Vec::new();
        for part in list {
            match *part {
                Observability::None => {}
                Observability::VelocitiesRemoved => {
                    let inputs = kept.len();
                    kept.retain(|&index| !spec.inputs[index].velocity);
                    let left = kept.len();
                    if left == 0 || left == inputs {
                        let task = spec.name.clone();
                        return Err(ObservabilityError::NothingToRemove { task, left, inputs });
                    }
                }
                Observability::Blackout {
                    numerator,
                    denominator,
                } => {
                    thresholds.push(threshold(numerator, denominator)?);
                }
            }
        }
        let inputs = kept
            .iter()
            .map(|&index| spec.inputs[index].clone())
            .collect();
        Ok(Self {
            inputs,
            kept,
            eased: thresholds.clone(),
            thresholds,
        })
    }

    /// Makes blackouts `stage`/`stages` times as probable as the stack says.
    pub fn ease(&mut self, stage: u32, stages: u32) {
        let share = |threshold: &u128| threshold * u128::from(stage) / u128::from(stages.max(1));
        self.eased = self.thresholds.iter().map(share).collect();
    }

    /// The channels that are left, in order.
    #[must_use]
    pub fn inputs(&self) -> &[Channel] {
        &self.inputs
    }

    /// Writes what the policy sees of a full observation; called once for each step, the first included.
    ///
    /// In a blackout every element is [`MISSING`]. Each blackout of the stack draws one [`Rng::word`], whether or not another one has struck. `out` has one element
    /// for each of [`inputs`](Self::inputs); of a slice with another length only the common part is written.
    pub fn apply(&mut self, full: &[f32], out: &mut [f32], rng: &mut Rng) {
        let mut dark = false;
        for &threshold in &self.eased {
            dark |= u128::from(rng.word()) < threshold;
        }
        for (out, &index) in out.iter_mut().zip(&self.kept) {
            *out = if dark {
                MISSING
            } else {
                full.get(index).copied().unwrap_or(0.0)
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{CartPole, Task as _, parse_stack};

    fn wrappers(text: &str) -> Result<Wrappers, ObservabilityError> {
        Wrappers::new(&parse_stack(text)?, CartPole::new().spec())
    }

    #[test]
    fn velocities_are_removed_only_once() {
        let error = wrappers("velocities-removed+velocities-removed").unwrap_err();
        assert_eq!(
            error.to_string(),
            "velocities-removed does not fit cartpole-v1: it would leave 2 of 2 inputs"
        );
    }

    #[test]
    fn an_impossible_fraction_is_refused() {
        let blackout = Observability::Blackout {
            numerator: 2,
            denominator: 1,
        };
        let error = Wrappers::new(&[blackout], CartPole::new().spec()).unwrap_err();
        assert_eq!(
            error,
            ObservabilityError::NotAProbability {
                numerator: 2,
                denominator: 1
            }
        );
    }

    #[test]
    fn removed_velocities_leave_the_positions() {
        let mut wrappers = wrappers("velocities-removed").unwrap();
        let left: Vec<_> = wrappers
            .inputs()
            .iter()
            .map(|channel| channel.name.as_str())
            .collect();
        assert_eq!(left, ["cart_position", "pole_angle"]);
        let mut out = [9.0; 2];
        wrappers.apply(&[1.0, 2.0, 3.0, 4.0], &mut out, &mut Rng::new(0));
        assert_eq!(out.map(f32::to_bits), [1.0f32, 3.0].map(f32::to_bits));
    }

    #[test]
    fn blackouts_come_as_often_as_they_say_and_blank_everything() {
        const STEPS: u32 = 100_000;
        for (text, p) in [
            ("1/3", 1.0 / 3.0),
            ("2/3", 2.0 / 3.0),
            ("0/1", 0.0),
            ("1/1", 1.0),
        ] {
            let mut wrappers = wrappers(&format!("blackout:{text}")).unwrap();
            let mut rng = Rng::new(11);
            let mut dark = 0;
            for _ in 0..STEPS {
                let mut out = [9.0; 4];
                wrappers.apply(&[1.0; 4], &mut out, &mut rng);
                let bits = out.map(f32::to_bits);
                let missing = [MISSING.to_bits(); 4];
                assert!(bits == missing || bits == [1.0f32.to_bits(); 4]);
                dark += u32::from(bits == missing);
            }
            // Five standard deviations of a binomial number; none at all for 0 and 1.
            let bound = 5.0 * (f64::from(STEPS) * p * (1.0 - p)).sqrt();
            assert!(
                (f64::from(dark) - f64::from(STEPS) * p).abs() <= bound,
                "{text}: {dark} of {STEPS}"
            );
        }
    }

    #[test]
    fn eased_blackouts_come_less_often_and_strike_none_that_the_task_spares() {
        let spec = CartPole::new();
        let full = vec![1.0; spec.spec().inputs.len()];
        let blanks = |stage: u32| -> Vec<bool> {
            let mut wrappers = wrappers("blackout:2/3").unwrap();
            wrappers.ease(stage, 4);
            let (mut rng, mut seen) = (Rng::new(3), full.clone());
            let mut blank = || {
                wrappers.apply(&full, &mut seen, &mut rng);
                seen[0].is_nan()
            };
            (0..6000).map(|_| blank()).collect()
        };
        let all = blanks(4);
        for stage in 0..=4 {
            let eased = blanks(stage);
            let count = eased.iter().filter(|blank| **blank).count();
            assert!(
                count.abs_diff(1000 * stage as usize) < 120,
                "{stage}: {count}"
            );
            assert!(eased.iter().zip(&all).all(|(eased, all)| !eased || *all));
        }
        let mut whole = wrappers("blackout:2/3").unwrap();
        whole.ease(4, 4);
        assert_eq!(whole.eased, wrappers("blackout:2/3").unwrap().eased);
    }

    #[test]
    fn two_blackouts_draw_a_word_each_in_every_step() {
        let mut wrappers = wrappers("blackout:1/1+blackout:1/2").unwrap();
        let (mut rng, mut words) = (Rng::new(12), Rng::new(12));
        for _ in 0..10 {
            wrappers.apply(&[1.0; 4], &mut [0.0; 4], &mut rng);
            words.word();
            words.word();
        }
        assert_eq!(rng, words);
    }
}
