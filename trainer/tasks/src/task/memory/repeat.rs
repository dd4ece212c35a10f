//! Naming the suit of a card that was seen before.

use super::deck::{self, Deck};
use super::{Level, PERIOD_US, SUITS, chosen, index, number, one_hot, step};
use crate::task::{ActionSpace, Rng, Spec, Step, Task};
use tpg_runtime::Action;

/// The specification of a task that shows a suit and asks for one.
fn spec(name: String, cards: usize) -> Spec {
    Spec {
        name,
        inputs: SUITS.map(number).to_vec(),
        outputs: vec![index("suit")],
        actions: ActionSpace::Discrete(deck::SUITS as u16),
        max_steps: cards as u32 - 1,
        period_us: PERIOD_US,
    }
}

/// Naming the suit of the first card, at every step: POPGym's RepeatFirst.
///
/// The observation is the suit of the card that was just dealt. A right answer earns 1 / (cards − 1), a wrong one costs as much, so
/// that returns lie between −1 and 1; chance has −0.5. There are 52, 416 or 832 cards.
#[derive(Debug, Clone)]
pub struct RepeatFirst {
    spec: Spec,
    deck: Deck,
}

impl RepeatFirst {
    /// Makes the task, its deck in order.
    #[must_use]
    pub fn new(level: Level) -> Self {
        let mut deck = Deck::new(level.pick([1, 8, 16]));
        deck.deal();
        RepeatFirst {
            spec: spec(format!("repeat-first:{}-v1", level.name()), deck.len()),
            deck,
        }
    }

    /// Starts an episode with the cards in this order. The last one is dealt first.
    pub fn set_order(&mut self, order: &[u16]) {
        self.deck.set_order(order);
        self.deck.deal();
    }
}

impl Task for RepeatFirst {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.deck.shuffle(rng);
        self.deck.deal();
    }

    fn observe(&self, observation: &mut [f32]) {
        one_hot(observation, deck::suit(self.deck.last()));
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let right = usize::from(chosen(action)) == deck::suit(self.deck.card(0));
        let reward = 1.0 / (self.deck.len() - 1) as f64;
        let terminated = self.deck.left() <= 1;
        self.deck.deal();
        step(if right { reward } else { -reward }, terminated)
    }
}

/// Naming the suit of the card that was seen some steps ago: POPGym's RepeatPrevious.
///
/// The observation is the suit of the card that was just dealt. With a lag of 0 that one is asked for. Once enough cards have been
/// seen, a right answer earns 1 / (cards − lag − 1), and a wrong one costs as much, so that returns lie between −1 and 1; chance
/// has −0.5. POPGym counts k = lag + 1. Its levels have k = 4, 32, 64 and 1, 2, 3 decks.
#[derive(Debug, Clone)]
pub struct RepeatPrevious {
    spec: Spec,
    deck: Deck,
    lag: usize,
}

impl RepeatPrevious {
    /// Makes the task at a level of POPGym, its decks in order.
    #[must_use]
    pub fn new(level: Level) -> Self {
        let (decks, lag) = level.pick([(1, 3), (2, 31), (3, 63)]);
        RepeatPrevious::of(level.name().to_owned(), decks, lag)
    }

    /// Makes the task with one deck and a lag of at most 50, larger ones counting as 50.
    #[must_use]
    pub fn with_lag(lag: u32) -> Self {
        let lag = lag.min(50);
        RepeatPrevious::of(lag.to_string(), 1, lag as usize)
    }

    fn of(parameter: String, decks: usize, lag: usize) -> Self {
        let mut deck = Deck::new(decks);
        deck.deal();
        RepeatPrevious {
            spec: spec(format!("repeat-previous:{parameter}-v1"), deck.len()),
            deck,
            lag,
        }
    }

    /// Starts an episode with the cards in this order. The last one is dealt first.
    pub fn set_order(&mut self, order: &[u16]) {
        self.deck.set_order(order);
        self.deck.deal();
    }
}

impl Task for RepeatPrevious {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.deck.shuffle(rng);
        self.deck.deal();
    }

    fn observe(&self, observation: &mut [f32]) {
        one_hot(observation, deck::suit(self.deck.last()));
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let reward = 1.0 / (self.deck.len() - self.lag - 1) as f64;
        let asked = self.deck.dealt().checked_sub(self.lag + 1);
        let reward = asked.map_or(0.0, |asked| {
            let right = usize::from(chosen(action)) == deck::suit(self.deck.card(asked));
            if right { reward } else { -reward }
        });
        let terminated = self.deck.left() <= 1;
        self.deck.deal();
        step(reward, terminated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The return of an agent that remembers all observations and answers from them.
    fn with_memory(task: &mut dyn Task, answer: impl Fn(&[u16]) -> u16) -> f64 {
        let mut rng = Rng::new(8);
        let mut total = 0.0;
        for _ in 0..10 {
            task.reset(&mut rng);
            let mut seen = Vec::new();
            loop {
                let mut observation = [0.0; 4];
                task.observe(&mut observation);
                let suit = observation.iter().position(|x| *x > 0.0).expect("one is 1");
                seen.push(suit as u16);
                let step = task.step(Action::Discrete(answer(&seen)));
                total += step.reward / 10.0;
                if step.terminated {
                    assert_eq!(seen.len() as u32, task.spec().max_steps);
                    break;
                }
            }
        }
        total
    }

    #[test]
    fn who_remembers_gets_1_and_who_does_not_gets_about_half_of_minus_1() {
        for level in Level::ALL {
            let mut first = RepeatFirst::new(level);
            let total = with_memory(&mut first, |seen| seen[0]);
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            let mut previous = RepeatPrevious::new(level);
            let lag = previous.lag;
            let back = |seen: &[u16]| seen.len().checked_sub(lag + 1).map_or(0, |k| seen[k]);
            let total = with_memory(&mut previous, back);
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            let total = with_memory(&mut previous, |_| 0);
            assert!((total + 0.5).abs() < 0.2, "{total}");
        }
    }

    #[test]
    fn a_lag_of_0_asks_for_what_is_seen() {
        let mut task = RepeatPrevious::with_lag(0);
        assert_eq!(task.spec().name, "repeat-previous:0-v1");
        let total = with_memory(&mut task, |seen| *seen.last().expect("a card"));
        assert!((total - 1.0).abs() < 1e-9, "{total}");
        assert_eq!(RepeatPrevious::with_lag(99).lag, 50);
    }
}
