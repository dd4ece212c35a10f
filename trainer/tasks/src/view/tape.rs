//! What is noted while episodes run.
//!
//! The arena's loop stays as it is: the task and the agent in it are wrapped, and both wrappers write to one tape.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tpg_runtime::tables::{ProgramId, Target};
use tpg_runtime::trace::Observer;
use tpg_runtime::{Action, HostAgent, ObservationError, Reset};

use crate::eval::{Controller, Reply};
use crate::task::{Pose, Rng, Scene, Spec, Step, Task, Wrappers};

/// The episodes so far.
#[derive(Debug, Default)]
pub(super) struct Tape {
    pub(super) episodes: Vec<Notes>,
}

/// What happened in one episode, step by step.
#[derive(Debug, Default)]
pub(super) struct Notes {
    /// Where each solid was, before the first step and after each.
    pub(super) poses: Vec<Pose>,
    /// What the policy would have seen without blackouts and disturbances, as often as `poses`.
    pub(super) truth: Vec<f32>,
    /// What it saw.
    pub(super) seen: Vec<f32>,
    /// What it did, as it arrived at the plant.
    pub(super) actions: Vec<f32>,
    pub(super) rewards: Vec<f64>,
    pub(super) decisions: Vec<Decision>,
    pub(super) terminated: bool,
    pub(super) unstable: bool,
}

/// What the programs did in one step.
#[derive(Debug, Default, Clone)]
pub(super) struct Decision {
    pub(super) bids: Vec<(u16, f32)>,
    /// The program that acted; where outputs have programs of their own, one for each output.
    pub(super) acted: Vec<u16>,
    /// The number of the action that it leads to.
    pub(super) action: Option<u16>,
    given: bool,
}

impl Tape {
    /// How much has been noted, in bytes.
    pub(super) fn bytes(&self) -> usize {
        let of = |notes: &Notes| {
            let bids: usize = notes.decisions.iter().map(|d| d.bids.len()).sum();
            let floats = notes.truth.len() + notes.seen.len() + notes.actions.len();
            size_of_val(&notes.poses[..]) + size_of_val(&notes.rewards[..]) + 4 * floats + 8 * bids
        };
        self.episodes.iter().map(of).sum()
    }
}

/// The tape, for one of the two that write to it. A poisoned one is as good as any: its notes are only added to.
fn lock(tape: &Mutex<Tape>) -> MutexGuard<'_, Tape> {
    tape.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A task that is followed.
pub(super) struct WatchedTask {
    task: Box<dyn Task>,
    /// Choose the channels that a policy sees, and are never dark.
    clear: Wrappers,
    full: Vec<f32>,
    kept: Vec<f32>,
    tape: Arc<Mutex<Tape>>,
}

impl WatchedTask {
    pub(super) fn new(task: Box<dyn Task>, mut wrappers: Wrappers, tape: Arc<Mutex<Tape>>) -> Self {
        wrappers.ease(0, 1);
        WatchedTask {
            full: vec![0.0; task.spec().inputs.len()],
            kept: vec![0.0; wrappers.inputs().len()],
            clear: wrappers,
            task,
            tape,
        }
    }

    /// Notes the state that the task is in.
    fn note(&mut self) {
        self.task.observe(&mut self.full);
        let mut rng = Rng::new(0);
        self.clear.apply(&self.full, &mut self.kept, &mut rng);
        if let Some(notes) = lock(&self.tape).episodes.last_mut() {
            self.task.poses(&mut notes.poses);
            notes.truth.extend(&self.kept);
        }
    }
}

impl Task for WatchedTask {
    fn spec(&self) -> &Spec {
        self.task.spec()
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.task.reset(rng);
        lock(&self.tape).episodes.push(Notes::default());
        self.note();
    }

    fn observe(&self, observation: &mut [f32]) {
        self.task.observe(observation);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let step = self.task.step(action);
        if let Some(notes) = lock(&self.tape).episodes.last_mut() {
            match action {
                Action::Discrete(index) => notes.actions.push(index.into()),
                Action::Continuous(values) => notes.actions.extend(values),
            }
            notes.rewards.push(step.reward);
            notes.terminated = step.terminated;
            notes.unstable |= step.unstable;
        }
        self.note();
        step
    }

    fn instability(&self) -> Option<String> {
        self.task.instability()
    }

    fn scene(&self) -> Scene {
        self.task.scene()
    }

    fn poses(&self, poses: &mut Vec<Pose>) {
        self.task.poses(poses);
    }
}

/// An agent that is followed.
pub(super) struct WatchedAgent<'p> {
    agent: Box<HostAgent<'p>>,
    tape: Arc<Mutex<Tape>>,
}

impl<'p> WatchedAgent<'p> {
    pub(super) fn new(agent: Box<HostAgent<'p>>, tape: Arc<Mutex<Tape>>) -> Self {
        WatchedAgent { agent, tape }
    }
}

impl Controller for WatchedAgent<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        Controller::reset(&mut *self.agent, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        let mut noted = Decision::default();
        let decision = self.agent.decide_traced(observation, &mut noted)?;
        if let Some(notes) = lock(&self.tape).episodes.last_mut() {
            notes.seen.extend(observation);
            notes.decisions.push(noted);
        }
        Ok(Reply {
            action: decision.action,
            instructions: decision.instructions,
        })
    }
}

impl Observer for Decision {
    fn bid(&mut self, ProgramId(program): ProgramId, bid: f32) {
        self.bids.push((program, bid));
    }

    fn choose(&mut self, ProgramId(program): ProgramId, target: Target) {
        if let (Target::Atomic(action), false) = (target, self.given) {
            (self.acted, self.action) = (vec![program], Some(action));
        }
    }

    fn give(&mut self, ProgramId(program): ProgramId, output: u16) {
        // The programs give all outputs; the highest bidder of all did not act alone.
        if !self.given {
            (self.given, self.action) = (true, None);
            self.acted.clear();
        }
        let output = usize::from(output);
        self.acted.resize(self.acted.len().max(output + 1), program);
        self.acted[output] = program;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{Arena, RandomController};
    use crate::task::{CartPole, parse_stack};
    use tpg_runtime::tables::TeamId;

    #[test]
    fn a_watched_task_gives_the_bits_of_one_that_is_not() {
        let wrappers = |task: &dyn Task| {
            Wrappers::new(&parse_stack("blackout:1/2").unwrap(), task.spec()).unwrap()
        };
        let tape = Arc::new(Mutex::new(Tape::default()));
        let run = |task: Box<dyn Task>| {
            let wrappers = wrappers(&*task);
            let mut random = RandomController::new(task.spec().actions);
            let mut arena = Arena::new(task, wrappers);
            arena.episode(&mut random, Reset::Agent, 5).unwrap()
        };
        let plain = CartPole::new();
        let clear = wrappers(&plain);
        let watched = WatchedTask::new(Box::new(CartPole::new()), clear, Arc::clone(&tape));
        let episode = run(Box::new(plain));
        assert_eq!(run(Box::new(watched)), episode);
        let tape = lock(&tape);
        let [notes] = &tape.episodes[..] else {
            panic!("one episode")
        };
        let steps = episode.steps as usize;
        assert_eq!(notes.rewards.len(), steps);
        assert_eq!(
            notes.poses.len(),
            (steps + 1) * CartPole::new().scene().solids.len()
        );
        assert_eq!(notes.truth.len(), (steps + 1) * 4);
        assert!(notes.truth.iter().all(|x| x.is_finite()), "nothing is dark");
        assert!(notes.terminated && !notes.unstable);
    }

    #[test]
    fn the_program_that_leads_to_an_action_has_acted() {
        let mut decision = Decision::default();
        decision.bid(ProgramId(4), 1.0);
        decision.choose(ProgramId(4), Target::Team(TeamId(1)));
        decision.bid(ProgramId(7), 2.0);
        decision.choose(ProgramId(7), Target::Atomic(1));
        assert_eq!((&decision.acted[..], decision.action), (&[7][..], Some(1)));
        assert_eq!(decision.bids, [(4, 1.0), (7, 2.0)]);
    }

    #[test]
    fn each_output_names_the_program_that_gave_it() {
        let mut decision = Decision::default();
        decision.choose(ProgramId(3), Target::Atomic(1));
        decision.give(ProgramId(2), 0);
        decision.give(ProgramId(3), 1);
        assert_eq!((&decision.acted[..], decision.action), (&[2, 3][..], None));
    }
}
