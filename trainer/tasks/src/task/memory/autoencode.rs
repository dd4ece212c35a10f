//! Naming cards in reverse order.

use super::deck::{self, Deck};
use super::{Level, PERIOD_US, SUITS, chosen, index, number, one_hot, step};
use crate::task::{ActionSpace, Rng, Spec, Step, Task};
use tpg_runtime::Action;

/// Naming the suits of all cards in reverse order, after the last one was shown: POPGym's Autoencode.
///
/// The observation says whether the agent plays or watches, and shows the suit of a card; spades while it plays, but for the first
/// step. A right answer earns 1 / cards, a wrong one costs as much; chance has −0.5. There are 52, 104 or 156 cards.
#[derive(Debug, Clone)]
pub struct Autoencode {
    spec: Spec,
    deck: Deck,
    /// Cards that the agent has not named yet, while it plays.
    hand: Option<usize>,
    shown: usize,
}

impl Autoencode {
    /// Makes the task, its decks in order.
    #[must_use]
    pub fn new(level: Level) -> Self {
        let deck = Deck::new(level.pick([1, 2, 3]));
        let inputs = ["play", "watch"].into_iter().chain(SUITS);
        let mut task = Autoencode {
            spec: Spec {
                name: format!("autoencode:{}-v1", level.name()),
                inputs: inputs.map(number).collect(),
                outputs: vec![index("suit")],
                actions: ActionSpace::Discrete(deck::SUITS as u16),
                max_steps: 2 * deck.len() as u32 - 1,
                period_us: PERIOD_US,
            },
            deck,
            hand: None,
            shown: 0,
        };
        task.begin();
        task
    }

    /// Starts an episode with the cards in this order. The last one is dealt first.
    pub fn set_order(&mut self, order: &[u16]) {
        self.deck.set_order(order);
        self.begin();
    }

    fn begin(&mut self) {
        self.deck.deal();
        self.hand = None;
        self.shown = deck::suit(self.deck.last());
    }
}

impl Task for Autoencode {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.deck.shuffle(rng);
        self.begin();
    }

    fn observe(&self, observation: &mut [f32]) {
        let (mode, card) = observation.split_at_mut(observation.len().min(2));
        one_hot(mode, usize::from(self.hand.is_none()));
        one_hot(card, self.shown);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let Some(hand) = self.hand else {
            self.deck.deal();
            self.shown = deck::suit(self.deck.last());
            if self.deck.left() == 0 {
                self.hand = Some(self.deck.len());
            }
            return step(0.0, false);
        };
        let last = hand.saturating_sub(1);
        let right = usize::from(chosen(action)) == deck::suit(self.deck.card(last));
        let reward = 1.0 / self.deck.len() as f64;
        self.hand = Some(last);
        self.shown = 0;
        step(if right { reward } else { -reward }, last == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_names_all_in_reverse_gets_1() {
        for level in Level::ALL {
            let mut task = Autoencode::new(level);
            task.reset(&mut Rng::new(2));
            let (mut seen, mut total, mut steps) = (Vec::new(), 0.0, 0);
            loop {
                let mut observation = [0.0f32; 6];
                task.observe(&mut observation);
                let [play, watch, suits @ ..] = observation;
                let suit = suits.iter().position(|x| *x > 0.0).expect("one is 1") as u16;
                if watch > 0.0 || seen.len() + 1 == task.deck.len() && steps < task.deck.len() {
                    seen.push(suit);
                }
                let answer = if play > 0.0 {
                    seen.pop().unwrap_or(0)
                } else {
                    0
                };
                let step = task.step(Action::Discrete(answer));
                (total, steps) = (total + step.reward, steps + 1);
                if step.terminated {
                    break;
                }
            }
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            assert_eq!(steps as u32, task.spec().max_steps);
        }
    }
}
