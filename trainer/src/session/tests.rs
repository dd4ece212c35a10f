//! What a session does between generations that no file shows.

use tpg_runtime::Policy;
use tpg_runtime::blob::ResetScope;

use super::{Session, Tally};
use crate::config::{Preset, resolve};
use crate::evolve::ResetRule;
use crate::lower::Mode;

fn session(preset: &str) -> Session {
    let preset = Preset::find(preset).expect("a preset");
    let small = ["evolution.population=20", "evolution.children=20"].map(str::to_owned);
    let config = resolve(&preset, None, &small).expect("complete");
    Session::new(config, 3).expect("sensible")
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
        assert!(session.memory.is_some(), "nothing was written");
        session.medians = medians;
        let newcomers = session.make_generation();
        session.score(&mut pool, &newcomers, &mut Tally::default());
        let first = &session.records[&newcomers[0].root];
        assert_eq!(first.memory.is_none(), wiped, "{medians:?}");
    }
}

#[test]
fn every_agents_own_rule_stands_in_its_blob() {
    let mut session = session("cartpole-evolved-resets");
    let newcomers = session.make_generation();
    let mut seen = Vec::new();
    for newcomer in newcomers {
        let blob = session.export(newcomer.root, 0, None, Mode::Compact);
        let blob = blob.expect("small enough");
        let scope = Policy::load(&blob).expect("valid").header().reset_scope;
        let rule = session.population.team(newcomer.root).reset_rule;
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
