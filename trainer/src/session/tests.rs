//! What a session does between generations that no file shows.

use std::collections::BTreeSet;
use std::sync::Arc;

use tpg_runtime::blob::ResetScope;
use tpg_runtime::{Action, HostAgent, Policy, Reset};

use super::eval_stats::EvalStats;
use super::{Session, SessionError};
use crate::config::{Preset, resolve};
use crate::evaluator::{Alone, AloneScore, Batch, Evaluator, EvaluatorError};
use crate::evolve::{ResetRule, TeamId};
use crate::front_end::Recording;
use crate::lower::Mode;
use crate::monitor::Monitor;
use crate::pool::Pool;
use tpg_tasks::eval::Episode;
use tpg_tasks::task::Rng;

fn session(preset: &str) -> Session {
    session_with(preset, &[])
}

fn session_with(preset: &str, settings: &[&str]) -> Session {
    let preset = Preset::find(preset).expect("a preset");
    let small = ["evolution.population=20", "evolution.children=20"];
    let all: Vec<String> = small
        .iter()
        .chain(settings)
        .map(|s| (*s).to_owned())
        .collect();
    let config = resolve(&preset, None, &all).expect("complete");
    Session::new(config, 3).expect("sensible")
}

/// What a root does about 200 drawn observations, in bits, and how many constants can be tuned.
fn behaviour(session: &Session, root: TeamId) -> (Vec<u32>, usize) {
    let blob = session.export(root, session.state.generation, None, Mode::Compact);
    let blob = blob.expect("small enough");
    let policy = Policy::load(&blob).expect("valid");
    let inputs = usize::from(policy.header().observation_len);
    let mut agent = Box::new(HostAgent::new(policy).expect("small enough"));
    agent.reset(Reset::Agent, 1);
    let mut rng = Rng::new(1);
    let mut bits = Vec::new();
    for _ in 0..200 {
        let observation: Vec<f32> = (0..inputs).map(|_| rng.normal() as f32).collect();
        match agent
            .decide(&observation)
            .expect("as long as it should be")
            .action
        {
            Action::Discrete(k) => bits.push(u32::from(k)),
            Action::Continuous(u) => bits.extend(u.iter().map(|x| x.to_bits())),
        }
    }
    let read = session.tunable(root).expect("constants").values().len();
    (bits, read)
}

/// Clones and memories begin without effect, and add constants that tuning can give them one by.
#[test]
fn what_a_line_grows_decides_as_before() {
    for preset in [
        "cartpole-champion",
        "pendulum-champion",
        #[cfg(feature = "mujoco")]
        "hopper-champion-b23",
    ] {
        let stateful = [
            "policy.register-mode=stateful",
            "policy.reset-scope=per-episode",
        ];
        let mut session = session_with(preset, &stateful);
        let mut pool = session.pool(1).expect("an arena");
        for _ in 0..2 {
            session.advance(&mut pool).expect("a generation");
        }
        let mut lineage = session.state.lineages[0].clone();
        let (before, read) = behaviour(&session, lineage.root);
        assert!(
            before.iter().any(|x| *x != before[0]),
            "{preset} does one thing"
        );
        session.remember_lineage(&mut lineage);
        let (remembers, more) = behaviour(&session, lineage.root);
        assert_eq!(before, remembers, "{preset}");
        assert!(more > read, "{preset} remembers nothing");
        if preset == "cartpole-champion" {
            // Its bids choose actions: a clone that bids differently changes what is chosen.
            continue;
        }
        session.grow_lineage(&mut lineage, &mut Rng::new(2));
        let (grown, most) = behaviour(&session, lineage.root);
        assert_eq!(before, grown, "{preset}");
        assert!(most > more, "{preset} did not grow");
    }
}

#[test]
fn after_their_trial_one_of_the_lineages_goes_on() {
    let settings = [
        "tuning.lines=3",
        "tuning.one-after=8",
        "tuning.iterations=4",
    ];
    let mut session = session_with("cartpole-champion", &settings);
    let mut pool = session.pool(1).expect("an arena");
    let mut lineages = Vec::new();
    let mut best = None;
    for _ in 0..5 {
        let averages = session
            .state
            .lineages
            .iter()
            .filter_map(|lineage| lineage.trial_average);
        best = averages.max_by(f64::total_cmp).or(best);
        session.advance(&mut pool).expect("a generation");
        lineages.push(session.state.lineages.len());
    }
    // A generation without iterations comes first.
    assert_eq!(lineages, [3, 3, 3, 1, 1]);
    assert!(best.is_some() && session.state.lineages[0].iterations == 16);
}

#[test]
fn lineages_that_are_halved_end_half_of_them_at_a_time() {
    let settings = [
        "tuning.lines=4",
        "tuning.one-after=8",
        "tuning.halve=true",
        "tuning.iterations=4",
    ];
    let mut session = session_with("cartpole-champion", &settings);
    let mut pool = session.pool(1).expect("an arena");
    let mut lineages = Vec::new();
    for _ in 0..4 {
        session.advance(&mut pool).expect("a generation");
        lineages.push(session.state.lineages.len());
    }
    // A generation without iterations comes first.
    assert_eq!(lineages, [4, 4, 2, 1]);
}

/// A new stage forgets what was scored in an easier one.
#[test]
fn at_a_new_stage_everyone_is_scored_again() {
    let settings = ["evaluation.curriculum.steps=12000", "evaluation.elites=1"];
    let mut session = session_with("cartpole-sr-b23", &settings);
    let mut pool = session.pool(1).expect("an arena");
    let mut stages = vec![session.state.stage];
    while session.state.stage < 4 {
        session.advance(&mut pool).expect("a generation");
        if stages.last() != Some(&session.state.stage) {
            stages.push(session.state.stage);
            let last = session.state.generation - 1;
            let mut records = session.state.records.values();
            assert!(records.all(|r| r.generation == last && r.scorings == 1));
        }
    }
    assert!(stages.is_sorted() && stages.len() > 2, "{stages:?}");
}

/// Who lies far behind after its first episodes plays no more. Everyone else is scored as without the setting, on any number of threads.
#[test]
fn who_lies_far_behind_is_dropped_early() {
    let dropping = ["evaluation.episodes=8", "evaluation.drop-after=3"];
    let all = || session_with("pendulum-sr", &dropping[..1]);
    let some = || session_with("pendulum-sr", &dropping);
    let (mut all, mut some, mut threads) = (all(), some(), some());
    let mut pool = all.pool(1).expect("an arena");
    let mut two = all.pool(2).expect("two arenas");
    let (mut steps, mut spared) = (0, 0);
    for _ in 0..6 {
        // Both make the same candidates of the same population.
        some.state = all.state.clone();
        threads.state = all.state.clone();
        let before = all.state.clone();
        all.advance(&mut pool).expect("a generation");
        some.advance(&mut pool).expect("a generation");
        threads.advance(&mut two).expect("a generation");
        some.state.seconds = 0.0;
        threads.state.seconds = 0.0;
        assert_eq!(some.state, threads.state);
        steps += all.state.steps - before.steps;
        spared += all.state.steps - some.state.steps;
        let survivors = |session: &Session| -> BTreeSet<TeamId> {
            session.state.population.roots.iter().copied().collect()
        };
        let lost = survivors(&all).difference(&survivors(&some)).count();
        assert!(lost <= 1, "{lost} survivors were dropped");
        for (root, record) in &some.state.records {
            if let Some(full) = all.state.records.get(root) {
                assert_eq!(full.score.to_bits(), record.score.to_bits());
            }
        }
    }
    assert!(spared > 0, "nobody of {steps} steps was dropped");
}

#[test]
fn dropping_is_refused_where_it_cannot_be() {
    for (preset, settings, part) in [
        (
            "cartpole-sr",
            ["evaluation.drop-after=5", "evaluation.episodes=5"],
            "evaluation.episodes = 5",
        ),
        (
            "cartpole-sr",
            ["evaluation.drop-after=1", "evaluation.episodes=5"],
            "at least 2",
        ),
        (
            "cartpole-per-agent",
            ["evaluation.drop-after=2", "evaluation.episodes=5"],
            "reset-scope",
        ),
    ] {
        let preset = Preset::find(preset).expect("a preset");
        let settings = settings.map(str::to_owned);
        let config = resolve(&preset, None, &settings).expect("well-formed");
        let refused = Session::new(config, 1).map(drop).expect_err("it cannot be");
        assert!(refused.to_string().contains(part), "{refused}");
    }
}

/// The population's memory is wiped before a generation exactly if the median fell in the last one (T §2.7).
#[test]
fn a_fallen_median_wipes_the_memory() {
    for (medians, wiped) in [
        ([Some(1.0), Some(2.0)], true),
        ([Some(2.0), Some(1.0)], false),
        ([Some(2.0), None], false),
    ] {
        let mut session = session("cartpole-on-fall");
        let mut pool = session.pool(1).expect("an arena");
        session.advance(&mut pool).expect("a generation");
        assert!(session.state.memory.is_some(), "nothing was written");
        session.state.medians = medians;
        let candidates = session.make_generation();
        let scored = session.score(&mut pool, &candidates, &mut EvalStats::default());
        scored.expect("nobody stops it");
        let first = &session.state.records[&candidates[0].root];
        assert_eq!(first.memory.is_none(), wiped, "{medians:?}");
    }
}

/// A pool that fails at one of its batches.
struct Failing {
    pool: Pool,
    batches_left: usize,
}

impl Evaluator for Failing {
    fn monitor(&self) -> &Arc<Monitor> {
        self.pool.monitor()
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        if self.batches_left == 0 {
            return Err(EvaluatorError::Failed("the wire broke".into()));
        }
        self.batches_left -= 1;
        self.pool.score(batch)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        self.pool.score_alone(alone)
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        self.pool.take_recordings()
    }
}

/// A generation in which scoring fails, at any of its batches, counts for nothing and can be made again.
#[test]
fn a_generation_that_could_not_be_scored_leaves_no_trace() {
    let mut session = session("cartpole-champion");
    let mut undisturbed = session_with("cartpole-champion", &[]);
    let mut pool = session.pool(1).expect("an arena");
    for batches_left in [0, 0, 1, 5, 4] {
        let mut failing = Failing {
            pool: session.pool(1).expect("an arena"),
            batches_left,
        };
        let before = session.state.clone();
        let error = session.advance(&mut failing).expect_err("it fails");
        let SessionError::Evaluation(cause) = error else {
            panic!("{error}");
        };
        assert_eq!(cause.to_string(), "the wire broke");
        assert_eq!(session.state, before);
        for session in [&mut session, &mut undisturbed] {
            session.advance(&mut pool).expect("a generation");
        }
        let champions = [&session, &undisturbed].map(|s| s.export_champion().expect("one"));
        assert_eq!(champions[0], champions[1]);
    }
}

#[test]
fn every_agents_own_rule_stands_in_its_blob() {
    let mut session = session("cartpole-evolved-resets");
    let candidates = session.make_generation();
    let mut seen = Vec::new();
    for candidate in candidates {
        let blob = session.export(candidate.root, 0, None, Mode::Compact);
        let blob = blob.expect("small enough");
        let scope = Policy::load(&blob).expect("valid").header().reset_scope;
        let rule = session.state.population.team(candidate.root).reset_rule;
        assert_eq!(rule.map(ResetRule::scope), Some(scope));
        seen.push(scope);
    }
    for scope in [
        ResetScope::PerAgent,
        ResetScope::MemoryPerAgent,
        ResetScope::MemoryPerEpisode,
        ResetScope::PerEpisode,
    ] {
        assert!(seen.contains(&scope), "no agent has {scope:?}");
    }
}
