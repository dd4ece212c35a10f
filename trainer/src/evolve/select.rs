//! Survival of roots.

use std::cmp::Ordering;

use super::{Population, TeamId};

/// Orders scored teams: higher scores first, older teams first among equal scores.
#[must_use]
pub fn rank(a: (TeamId, f64), b: (TeamId, f64)) -> Ordering {
    b.1.total_cmp(&a.1).then(a.0.cmp(&b.0))
}

/// Keeps the best `keep` roots by [`rank`], and the protected ones. Drops teams and programs that no root reaches any more.
///
/// `scores` holds every root with its score. Afterwards it holds the roots that are left, oldest first.
pub fn select(
    population: &mut Population,
    scores: &mut Vec<(TeamId, f64)>,
    keep: usize,
    protected: &[TeamId],
) {
    scores.sort_by(|a, b| rank(*a, *b));
    let beaten = scores.split_off(keep.min(scores.len()));
    scores.extend(beaten.into_iter().filter(|(id, _)| protected.contains(id)));
    scores.sort_by_key(|(team_id, _)| *team_id);
    population.roots = scores.iter().map(|(team_id, _)| *team_id).collect();
    population.collect();
}
