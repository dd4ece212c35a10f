//! What holds for all runs, tried on random ones: rates, sizes, cases and seeds are drawn by proptest.

use std::sync::Arc;

use proptest::prelude::*;
use proptest::test_runner::Config;
use tpg_runtime::blob::encode;
use tpg_runtime::{Blob, HostAgent, Policy};
use tpg_tasks::eval::{Arena, Episode, evaluate};
use tpg_tasks::task::{Pendulum, Rng, Task as _, Wrappers};

use super::tests::{Case, cases, genes, policy_spec};
use super::{Mode, lower};
use crate::evolve::{
    ActionPrograms, EvolutionParams, Genes, Population, Program, ProgramId, Team, TeamId,
    Variation, select,
};

const GENERATIONS: u32 = 6;

/// Any rates, and small sizes.
fn any_params() -> impl Strategy<Value = EvolutionParams> {
    let rates = proptest::array::uniform16(0.0..=1.0f64);
    let sizes = (1u32..6, 1u32..30, 1u32..5);
    (rates, sizes, any::<[bool; 2]>()).prop_map(|(rates, (team, code, tournament), [a, b])| {
        let mut params = crate::evolve::tests::params();
        (params.population, params.children) = (12, 10);
        params.tournament = tournament;
        (params.team.size.initial_max, params.team.size.max) = (team, team + 2);
        (
            params.program.size.initial_min,
            params.program.size.initial_max,
        ) = (1, code);
        params.program.size.max = code + 3;
        let team = &mut params.team;
        [team.crossover, team.inherit, team.delete, team.add] =
            [rates[0], rates[1], rates[2], rates[3]];
        [team.reorder, team.mutate, team.grow, team.remember] =
            [rates[4], rates[5], rates[6], rates[7]];
        let program = &mut params.program;
        [program.code, program.change, program.swap, program.delete] =
            [rates[8], rates[9], rates[10], rates[11]];
        [program.add, program.action, program.atomic, program.offset] =
            [rates[12], rates[13], rates[14], rates[15]];
        (params.team.repeat, params.program.insist) = (a, b);
        params
    })
}

/// The same with room for a program of each output, where these have programs of their own.
fn fitted(mut params: EvolutionParams, case: &Case) -> EvolutionParams {
    if case.action_programs == ActionPrograms::Each {
        params.team.size.max = params.team.size.max.max(4);
    }
    params
}

/// Runs evolution with random scores; `look` sees the population before and after each generation's children.
fn evolve(
    genes: &Genes,
    params: &EvolutionParams,
    seed: u64,
    mut look: impl FnMut(&Population, &Population),
) -> Population {
    let mut rng = Rng::new(seed);
    let mut population = Population::random(genes, params, &mut rng);
    let mut scores: Vec<(TeamId, f64)> = population.roots.iter().map(|r| (*r, 0.0)).collect();
    for _ in 0..GENERATIONS {
        let before = population.clone();
        let variation = Variation {
            genes,
            params,
            scores: &scores,
        };
        for child in variation.children(&mut population, &mut rng) {
            let size = population.reachable(child.team).len() as f64;
            scores.push((child.team, size + rng.uniform(0.0, 1.0)));
        }
        look(&before, &population);
        select(
            &mut population,
            &mut scores,
            params.population as usize,
            params.ties,
            &[],
        );
    }
    population
}

/// What children may not do: change what was there, or be larger than allowed.
fn assert_children_are_new(params: &EvolutionParams, before: &Population, after: &Population) {
    let same = |id: &TeamId, team: &Arc<Team>| **after.team(*id) == **team;
    assert!(before.teams.iter().all(|(id, team)| same(id, team)));
    let same = |id: &ProgramId, program: &Arc<Program>| **after.program(*id) == **program;
    assert!(
        before
            .programs
            .iter()
            .all(|(id, program)| same(id, program))
    );
    assert_eq!(
        after.roots.len(),
        before.roots.len() + params.children as usize
    );
    for team in after.teams.values() {
        assert!((1..=params.team.size.max as usize).contains(&team.members.len()));
    }
    for program in after.programs.values() {
        assert!(program.instructions.len() <= params.program.size.max as usize);
        assert!(program.constants.values().iter().all(|x| x.is_finite()));
    }
}

proptest! {
    #![proptest_config(Config { cases: 48, failure_persistence: None, ..Config::default() })]

    /// Crossover and mutation keep what a population promises, with any rates.
    #[test]
    fn children_keep_the_invariants(seed: u64, case in 0usize..7, params in any_params()) {
        let case = &cases()[case];
        let (genes, params) = (genes(case), fitted(params, case));
        evolve(&genes, &params, seed, |before, after| {
            assert_eq!(after.check(&genes), Ok(()));
            assert_children_are_new(&params, before, after);
        });
    }

    /// Whatever evolution makes passes the runtime's check, and decoding and encoding it gives the same bytes.
    #[test]
    fn what_evolves_verifies_and_survives_a_round_trip(seed: u64, case in 0usize..7, params in any_params()) {
        let case = &cases()[case];
        let (genes, params) = (genes(case), fitted(params, case));
        let spec = policy_spec(case, genes.shape);
        let population = evolve(&genes, &params, seed, |_, _| {});
        for root in &population.roots {
            for mode in [Mode::Whole, Mode::Counting, Mode::Compact] {
                let blob = lower(&population, *root, &spec, [7; 16], None, mode);
                let blob = blob.expect("far below the format's limits");
                let policy = Policy::load(&blob).expect("a lowered policy verifies");
                let decoded = Blob::decode(&blob).expect("as the policy did");
                let mut again = vec![0; blob.len()];
                let len = encode(decoded.header(), decoded.tables(), &mut again).expect("as long");
                assert_eq!((len, &again), (blob.len(), &blob));
                assert_eq!(policy.header().provenance, [7; 16]);
            }
        }
    }

    /// A policy as evolved and its compacted form have the same episodes: returns, lengths, in every bit. So do a task that ran
    /// other episodes before and a fresh one.
    #[test]
    fn whole_and_compact_have_the_same_episodes(seed: u64, case in 0usize..3, generations in 0u64..3) {
        // Pendulum has three inputs and one torque of at most 2, as these cases have.
        let case = &cases()[[1, 3, 5][case]];
        let params = crate::evolve::tests::params();
        let genes = genes(case);
        let spec = policy_spec(case, genes.shape);
        let population = evolve(&genes, &params, seed ^ generations, |_, _| {});
        let mut reused = pendulum();
        for root in population.roots.iter().take(4) {
            let episodes = |arena: &mut Arena, mode: Mode| -> Vec<Episode> {
                let blob = lower(&population, *root, &spec, [0; 16], None, mode).expect("small");
                let policy = Policy::load(&blob).expect("sound");
                let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
                evaluate(arena, &mut *agent, [seed, seed + 1]).expect("the right length")
            };
            let compact = episodes(&mut reused, Mode::Compact);
            let fresh = episodes(&mut pendulum(), Mode::Compact);
            assert_eq!(compact, fresh);
            let whole = episodes(&mut reused, Mode::Whole);
            // The compacted one executes fewer instructions.
            for (whole, compact) in whole.iter().zip(&compact) {
                assert_eq!(whole.total.to_bits(), compact.total.to_bits());
                assert_eq!(whole.steps, compact.steps);
                assert!(compact.instructions <= whole.instructions);
            }
        }
    }
}

fn pendulum() -> Arena {
    let task = Pendulum::new();
    let wrappers = Wrappers::new(&[], task.spec()).expect("nothing is hidden");
    Arena::new(Box::new(task), wrappers)
}
