//! Counting what was seen.

use super::deck::{self, Deck};
use super::{Level, PERIOD_US, SUITS, chosen, index, number, one_hot, step};
use crate::task::{ActionSpace, Channel, Rng, Spec, Step, Task};
use tpg_runtime::Action;

const COLOURS: [&str; 2] = ["black", "red"];
const RANKS: [&str; 13] = [
    "ace", "2", "3", "4", "5", "6", "7", "8", "9", "10", "jack", "queen", "king",
];

/// Saying how often a kind of card was dealt so far: POPGym's CountRecall.
///
/// The observation shows the kind of the card that was just dealt, and the kind that is asked for, drawn from decks of its own. A
/// right answer earns 1 / (cards − 1), a wrong one costs as much. Easy has the 2 colours of one deck, medium the 4 suits of two,
/// hard the 13 ranks of four.
#[derive(Debug, Clone)]
pub struct CountRecall {
    spec: Spec,
    values: Deck,
    queries: Deck,
    kind: fn(usize) -> usize,
    kinds: usize,
    counts: [u16; RANKS.len()],
}

impl CountRecall {
    /// Makes the task, its decks in order.
    #[must_use]
    pub fn new(level: Level) -> Self {
        type Kinds = (usize, fn(usize) -> usize, &'static [&'static str]);
        let (decks, kind, names): Kinds = level.pick([
            (1, deck::colour, &COLOURS),
            (2, deck::suit, &SUITS),
            (4, deck::rank, &RANKS),
        ]);
        let values = Deck::new(decks);
        let channels = |what: &str| -> Vec<Channel> {
            names
                .iter()
                .map(|name| number(format!("{what}_{name}")))
                .collect()
        };
        let mut task = CountRecall {
            spec: Spec {
                name: format!("count-recall:{}-v1", level.name()),
                inputs: [channels("dealt"), channels("asked")].concat(),
                outputs: vec![index("count")],
                actions: ActionSpace::Discrete((values.len() / names.len()) as u16 + 1),
                max_steps: values.len() as u32 - 1,
                period_us: PERIOD_US,
            },
            queries: values.clone(),
            values,
            kind,
            kinds: names.len(),
            counts: [0; RANKS.len()],
        };
        task.begin();
        task
    }

    /// Starts an episode with the cards, and those that ask, in these orders. The last ones are dealt first.
    pub fn set_orders(&mut self, values: &[u16], queries: &[u16]) {
        self.values.set_order(values);
        self.queries.set_order(queries);
        self.begin();
    }

    fn begin(&mut self) {
        self.counts = [0; RANKS.len()];
        self.deal();
    }

    fn deal(&mut self) {
        self.values.deal();
        self.queries.deal();
        let value = (self.kind)(self.values.last());
        if let Some(count) = self.counts.get_mut(value) {
            *count += 1;
        }
    }
}

impl Task for CountRecall {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.values.shuffle(rng);
        self.queries.shuffle(rng);
        self.begin();
    }

    fn observe(&self, observation: &mut [f32]) {
        let (dealt, asked) = observation.split_at_mut(observation.len().min(self.kinds));
        one_hot(dealt, (self.kind)(self.values.last()));
        one_hot(asked, (self.kind)(self.queries.last()));
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let asked = (self.kind)(self.queries.last());
        let right = self.counts.get(asked) == Some(&chosen(action));
        let reward = 1.0 / (self.values.len() - 1) as f64;
        self.deal();
        let terminated = self.values.left() == 0;
        step(if right { reward } else { -reward }, terminated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_counts_gets_1() {
        for level in Level::ALL {
            let mut task = CountRecall::new(level);
            task.reset(&mut Rng::new(4));
            let kinds = task.kinds;
            let (mut counts, mut total, mut steps) = (vec![0u16; kinds], 0.0, 0);
            loop {
                let mut observation = vec![0.0f32; 2 * kinds];
                task.observe(&mut observation);
                let (dealt, asked) = observation.split_at(kinds);
                let place = |x: &[f32]| x.iter().position(|x| *x > 0.0).expect("one is 1");
                counts[place(dealt)] += 1;
                let step = task.step(Action::Discrete(counts[place(asked)]));
                (total, steps) = (total + step.reward, steps + 1);
                if step.terminated {
                    break;
                }
            }
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            assert_eq!(steps, task.spec().max_steps);
        }
    }
}
