//! How many jobs travel together to another process.

use super::{Job, Split, jobs};

/// A pack holds at most this share of the expected work that is left, per worker.
const SHARE: f64 = 32.0;
/// And at most so many jobs, which bounds the length of a message.
const LONGEST: usize = 64;

/// The jobs of a batch that nobody has taken yet, in their order.
///
/// Packs shrink towards the end, as in guided self-scheduling: many short episodes cost few messages, and all workers
/// end together.
#[derive(Debug)]
pub struct Packs {
    jobs: Vec<Job>,
    /// Expected work of each job.
    work: Vec<f64>,
    next: usize,
    left: f64,
    workers: f64,
}

impl Packs {
    /// The jobs of a batch for so many workers, of which `expected` tells how long an episode of each policy lasts.
    #[must_use]
    pub fn new(expected: &[f64], episodes: usize, split: Split, workers: usize) -> Self {
        // All are split into episodes, where they may be. What was expected can be far off, and a worker with a whole policy of
        // long episodes would keep all others waiting. Episodes of one policy travel together as long as packs are large.
        let jobs = jobs(expected, episodes, split, expected.len().max(2));
        let of = |job: &Job| expected[job.policy].max(0.0) * job.episodes as f64;
        let work: Vec<f64> = jobs.iter().map(of).collect();
        Packs {
            left: work.iter().sum(),
            jobs,
            work,
            next: 0,
            workers: workers as f64,
        }
    }

    /// Whether none is left.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.next == self.jobs.len()
    }

    /// The next job alone.
    pub fn one(&mut self) -> Option<Job> {
        let job = *self.jobs.get(self.next)?;
        self.left -= self.work[self.next];
        self.next += 1;
        Some(job)
    }

    /// The next jobs for one worker: at least one, if any is left.
    pub fn pack(&mut self) -> Vec<Job> {
        let share = self.left / (SHARE * self.workers);
        let mut taken = 0.0;
        let mut pack = Vec::new();
        while let Some(work) = self.work.get(self.next) {
            if pack.len() == LONGEST || !pack.is_empty() && taken + work > share {
                break;
            }
            taken += work;
            pack.extend(self.one());
        }
        pack
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(expected: &[f64], workers: usize) -> Vec<usize> {
        let mut packs = Packs::new(expected, 1, Split::Agents, workers);
        let mut sizes = Vec::new();
        while !packs.is_empty() {
            sizes.push(packs.pack().len());
        }
        sizes
    }

    #[test]
    fn packs_shrink_to_single_jobs() {
        let sizes = sizes(&[1.0; 160], 2);
        assert_eq!(sizes.iter().sum::<usize>(), 160);
        assert_eq!(sizes[0], 2);
        assert_eq!(sizes.last(), Some(&1));
        assert!(sizes.is_sorted_by(|a, b| a >= b));
    }

    #[test]
    fn a_job_longer_than_the_share_travels_alone() {
        assert_eq!(sizes(&[100.0, 1.0, 1.0], 2)[0], 1);
    }

    #[test]
    fn jobs_of_no_expected_work_travel_too() {
        assert_eq!(sizes(&[0.0; 3], 2).iter().sum::<usize>(), 3);
    }
}
