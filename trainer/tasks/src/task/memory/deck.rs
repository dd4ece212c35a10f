//! Playing cards, as POPGym numbers and deals them.

use crate::task::Rng;

/// Cards of one deck.
const DECK: usize = 52;
/// Number of suits.
pub(super) const SUITS: usize = 4;

/// One or more decks that are dealt from the end of a shuffled order.
#[derive(Debug, Clone)]
pub(super) struct Deck {
    order: Vec<u16>,
    /// Cards dealt so far.
    dealt: usize,
}

impl Deck {
    /// Decks in order, nothing dealt.
    pub(super) fn new(decks: usize) -> Self {
        let cards = u16::try_from(decks * DECK).unwrap_or(u16::MAX);
        Deck {
            order: (0..cards).collect(),
            dealt: 0,
        }
    }

    /// Number of cards.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// Takes all cards back and shuffles them: every order is as probable.
    pub(super) fn shuffle(&mut self, rng: &mut Rng) {
        for (k, card) in self.order.iter_mut().enumerate() {
            *card = k as u16;
        }
        for k in (1..self.order.len()).rev() {
            let other = rng.below(k as u64 + 1) as usize;
            self.order.swap(k, other);
        }
        self.dealt = 0;
    }

    /// Takes all cards back and puts them in this order. The last one is dealt first. Of another number of cards only the common
    /// part is taken.
    pub(super) fn set_order(&mut self, order: &[u16]) {
        for (card, given) in self.order.iter_mut().zip(order) {
            *card = *given;
        }
        self.dealt = 0;
    }

    /// Cards that are not dealt yet.
    pub(super) fn left(&self) -> usize {
        self.order.len() - self.dealt
    }

    /// Cards dealt so far.
    pub(super) fn dealt(&self) -> usize {
        self.dealt
    }

    /// Deals a card, if there is one left.
    pub(super) fn deal(&mut self) {
        self.dealt = (self.dealt + 1).min(self.order.len());
    }

    /// The card that was dealt as number `k`, counted from 0; card 0 where there is none.
    pub(super) fn card(&self, k: usize) -> usize {
        let at = self.order.len().checked_sub(k + 1);
        at.and_then(|at| self.order.get(at))
            .map_or(0, |card| usize::from(*card))
    }

    /// The card that was dealt last.
    pub(super) fn last(&self) -> usize {
        self.card(self.dealt.saturating_sub(1))
    }
}

/// A card's suit: spades, diamonds, clubs, hearts.
pub(super) const fn suit(card: usize) -> usize {
    card % SUITS
}

/// A card's colour by POPGym's count, which alternates from card to card.
pub(super) const fn colour(card: usize) -> usize {
    card % 2
}

/// A card's rank, the ace first.
pub(super) const fn rank(card: usize) -> usize {
    card % DECK / SUITS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffled_deck_has_every_card_and_each_comes_first_equally_often() {
        let (mut deck, mut rng) = (Deck::new(2), Rng::new(3));
        let mut first = [0u32; 2 * DECK];
        for _ in 0..20_000 {
            deck.shuffle(&mut rng);
            deck.deal();
            first[deck.last()] += 1;
        }
        let mut cards = deck.order.clone();
        cards.sort_unstable();
        assert!(
            cards
                .iter()
                .enumerate()
                .all(|(k, card)| k == usize::from(*card))
        );
        // The expected count is 192 with a standard deviation of 14.
        assert!(
            first.iter().all(|count| (120..264).contains(count)),
            "{first:?}"
        );
    }

    #[test]
    fn cards_are_dealt_from_the_end() {
        let mut deck = Deck::new(1);
        for k in 0..DECK {
            assert_eq!((deck.left(), deck.dealt()), (DECK - k, k));
            deck.deal();
            assert_eq!((deck.last(), deck.card(0)), (DECK - 1 - k, DECK - 1));
        }
        deck.deal();
        assert_eq!((deck.left(), deck.last()), (0, 0));
    }

    #[test]
    fn suits_alternate_and_four_cards_have_a_rank() {
        let suits: Vec<usize> = (0..5).map(suit).collect();
        assert_eq!(suits, [0, 1, 2, 3, 0]);
        assert_eq!(
            [rank(0), rank(3), rank(4), rank(51), rank(52)],
            [0, 0, 1, 12, 0]
        );
        assert_eq!([colour(0), colour(1), colour(2)], [0, 1, 0]);
    }
}
