//! Survival of roots.

use std::cmp::Ordering;

use super::{Population, TeamId};
use crate::keys::named;

/// Who is preferred among teams of equal scores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ties {
    /// The older one.
    #[default]
    Older,
    /// The younger one. So a population drifts where nothing tells teams apart.
    Younger,
}

impl Ties {
    /// Every value.
    pub const ALL: &'static [Self] = &[Self::Older, Self::Younger];

    /// The name used in configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Older => "older",
            Self::Younger => "younger",
        }
    }

    /// Orders scored teams: higher scores first, among equal scores who is preferred.
    #[must_use]
    pub fn rank(self, a: (TeamId, f64), b: (TeamId, f64)) -> Ordering {
        let equals = match self {
            Self::Older => a.0.cmp(&b.0),
            Self::Younger => b.0.cmp(&a.0),
        };
        b.1.total_cmp(&a.1).then(equals)
    }
}

named!(Ties);

/// Orders scored teams: higher scores first, older teams first among equal scores.
#[must_use]
pub fn rank(a: (TeamId, f64), b: (TeamId, f64)) -> Ordering {
    Ties::Older.rank(a, b)
}

/// Keeps the best `keep` roots by [`Ties::rank`], and the protected ones. Drops teams and programs that no root reaches any more.
///
/// `scores` holds every root with its score. Afterwards it holds the roots that are left, oldest first.
pub fn select(
    population: &mut Population,
    scores: &mut Vec<(TeamId, f64)>,
    keep: usize,
    ties: Ties,
    protected: &[TeamId],
) {
    scores.sort_by(|a, b| ties.rank(*a, *b));
    let beaten = scores.split_off(keep.min(scores.len()));
    scores.extend(beaten.into_iter().filter(|(id, _)| protected.contains(id)));
    scores.sort_by_key(|(team_id, _)| *team_id);
    population.roots = scores.iter().map(|(team_id, _)| *team_id).collect();
    population.collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_are_ordered_by_age() {
        let order = |ties: Ties| {
            let mut scores = [(1, 2.0), (2, 3.0), (3, 2.0)].map(|(id, score)| (TeamId(id), score));
            scores.sort_by(|a, b| ties.rank(*a, *b));
            scores.map(|(id, _)| id.0)
        };
        assert_eq!(order(Ties::Older), [2, 1, 3]);
        assert_eq!(order(Ties::Younger), [2, 3, 1]);
    }
}
