//! Variation has the rates that configurations name, and tournaments the pressure that their formula says: Pearson's χ² at one
//! in a thousand. Seeds are fixed, so a test passes always or never.

use std::collections::BTreeMap;

use super::tests::{genes, params};
use super::*;
use tpg_tasks::task::Rng;

const CHILDREN: u32 = 20_000;

/// The value that χ² of so many degrees of freedom exceeds once in a thousand times (Wilson and Hilferty).
fn limit(degrees: usize) -> f64 {
    let n = degrees as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + 3.090_232 * part.sqrt()).powi(3)
}

/// Fails if counts differ from shares by more than chance.
fn assert_shares(what: &str, counts: &[u32], shares: &[f64]) {
    assert_eq!(counts.len(), shares.len());
    let whole: f64 = shares.iter().sum();
    assert!((whole - 1.0).abs() < 1e-9, "{what}: shares of {whole}");
    let n = f64::from(counts.iter().sum::<u32>());
    let found: f64 = counts
        .iter()
        .zip(shares)
        .map(|(count, share)| (f64::from(*count) - n * share).powi(2) / (n * share))
        .sum();
    let limit = limit(counts.len() - 1);
    println!("{what}: χ² {found:.1}, limit {limit:.1}, {counts:?}");
    assert!(
        n > 1000.0 && found < limit,
        "{what}: {counts:?}, not {shares:?}"
    );
}

/// Fails if something does not happen with this rate.
fn assert_rate(what: &str, happened: impl Iterator<Item = bool>, rate: f64) {
    let mut counts = [0, 0];
    happened.for_each(|yes| counts[usize::from(yes)] += 1);
    assert_shares(what, &counts, &[1.0 - rate, rate]);
}

/// Rates of zero; a team then differs from its parent in the name of one program.
fn still() -> EvolutionParams {
    let mut params = params();
    (params.population, params.children) = (40, CHILDREN);
    params.tournament = 1;
    let team = &mut params.team;
    // Teams of four programs, so that nothing is at a bound.
    (team.size.initial_min, team.size.initial_max) = (4, 4);
    [team.crossover, team.delete, team.add, team.reorder] = [0.0; 4];
    [team.mutate, team.reset, team.grow, team.remember] = [1e-300, 0.0, 0.0, 0.0];
    let program = &mut params.program;
    (program.size.initial_min, program.size.initial_max) = (10, 10);
    [program.code, program.change, program.swap, program.delete] = [0.0; 4];
    [program.add, program.action, program.offset] = [0.0; 3];
    params.constants.mutate = 0.0;
    params
}

/// The children of one generation, each beside its parent.
fn families(params: &EvolutionParams) -> (Population, Vec<Child>) {
    let genes = genes();
    let mut rng = Rng::new(5);
    let mut population = Population::random(&genes, params, &mut rng);
    let scores: Vec<_> = population.roots.iter().map(|r| (*r, 0.0)).collect();
    let variation = Variation {
        genes: &genes,
        params,
        scores: &scores,
    };
    let children = variation.children(&mut population, &mut rng);
    (population, children)
}

/// What `look` finds in each child, given its parent's team and its own.
fn seen<T>(params: &EvolutionParams, look: impl Fn(&Population, &Team, &Team) -> T) -> Vec<T> {
    let (population, children) = families(params);
    let pair = |c: &Child| {
        look(
            &population,
            population.team(c.parent),
            population.team(c.team),
        )
    };
    children.iter().map(pair).collect()
}

/// What `look` finds in the program that each child replaced, given that program before and after.
fn mutated<T>(params: &EvolutionParams, look: impl Fn(&Program, &Program) -> T) -> Vec<T> {
    seen(params, |population, parent, child| {
        let pairs = parent.members.iter().zip(&child.members);
        let (before, after) = pairs
            .into_iter()
            .find(|(before, after)| before != after)
            .expect("one program of each child is new");
        look(population.program(*before), population.program(*after))
    })
}

#[test]
fn tournaments_prefer_the_best_as_their_size_says() {
    const ROOTS: usize = 12;
    for (size, ties) in [
        (1, Ties::Older),
        (2, Ties::Older),
        (5, Ties::Older),
        (3, Ties::Younger),
    ] {
        let genes = genes();
        let mut params = still();
        (params.population, params.tournament, params.ties) = (ROOTS as u32, size, ties);
        let mut rng = Rng::new(7);
        let mut population = Population::random(&genes, &params, &mut rng);
        // Two teams share each score, so that ties count.
        let scored = population.roots.iter().enumerate();
        let scores: Vec<_> = scored
            .map(|(k, root)| (*root, (k * 5 % ROOTS / 2) as f64))
            .collect();
        let mut order = scores.clone();
        order.sort_by(|a, b| ties.rank(*a, *b));
        let variation = Variation {
            genes: &genes,
            params: &params,
            scores: &scores,
        };
        let mut counts = vec![0; ROOTS];
        for child in variation.children(&mut population, &mut rng) {
            let place = order.iter().position(|(root, _)| *root == child.parent);
            counts[place.expect("a root")] += 1;
        }
        // The best of `size` draws has place k where all lie at k or behind, and not all behind it.
        let behind = |k: usize| ((ROOTS - k) as f64 / ROOTS as f64).powi(size as i32);
        let shares: Vec<_> = (0..ROOTS).map(|k| behind(k) - behind(k + 1)).collect();
        assert_shares(
            &format!("a tournament of {size}, {}", ties.name()),
            &counts,
            &shares,
        );
    }
}

#[test]
fn teams_cross_and_vary_with_their_rates() {
    let mut params = still();
    (params.team.crossover, params.team.inherit) = (0.3, 1.0);
    let crossed = seen(&params, |_, parent, child| {
        child.members.len() > parent.members.len()
    });
    assert_rate("crossover", crossed.into_iter(), 0.3);

    let mut params = still();
    params.team.delete = 0.15;
    let lost = seen(&params, |population, parent, child| {
        // A team keeps a program with an atomic action, which all of them have here.
        assert!(
            child
                .members
                .iter()
                .all(|m| population.program(*m).is_atomic())
        );
        child.members.len() < parent.members.len()
    });
    assert_rate("losing a program", lost.into_iter(), 0.15);

    let mut params = still();
    params.team.add = 0.2;
    // One of 160 programs is drawn. The four that the team has are not taken twice.
    let won = seen(&params, |_, parent, child| {
        child.members.len() > parent.members.len()
    });
    assert_rate("gaining a program", won.into_iter(), 0.2 * 156.0 / 160.0);

    let mut params = still();
    params.team.reorder = 0.4;
    let moved = seen(&params, |population, parent, child| {
        let code = |team: &Team| -> Vec<_> {
            let programs = team.members.iter().map(|m| population.program(*m));
            programs
                .map(|program| program.instructions.clone())
                .collect()
        };
        code(parent) != code(child)
    });
    // One move of four ends where it began.
    assert_rate("moving a program", moved.into_iter(), 0.4 * 0.75);

    let mut params = still();
    params.team.reset = 0.25;
    let rules = seen(&params, |_, parent, child| {
        parent.reset_rule != child.reset_rule
    });
    let kinds = distinct_rules();
    let rate = 0.25 * (1.0 - 1.0 / kinds as f64);
    assert_rate("drawing a rule of resets", rules.into_iter(), rate);
}

/// How many rules of resets there are.
fn distinct_rules() -> usize {
    let mut rng = Rng::new(1);
    let mut rules: Vec<ResetRule> = Vec::new();
    for _ in 0..1000 {
        let rule = ResetRule::random(&mut rng);
        if !rules.contains(&rule) {
            rules.push(rule);
        }
    }
    rules.len()
}

#[test]
fn each_program_of_two_parents_is_inherited_with_its_rate() {
    const INHERIT: f64 = 0.6;
    let mut params = still();
    (params.team.crossover, params.team.inherit) = (1.0, INHERIT);
    let (population, children) = families(&params);
    // Whose a program is, by its code: all of them are distinct, and mutation leaves the code alone here.
    let owner = |member: &ProgramId| {
        let code = &population.program(*member).instructions;
        let owns = |root: &&TeamId| {
            let members = &population.team(**root).members;
            members
                .iter()
                .any(|m| population.program(*m).instructions == *code)
        };
        let first = params.population as usize;
        population.roots[..first]
            .iter()
            .find(owns)
            .copied()
            .expect("a parent")
    };
    let mut counts = [0; 4];
    for child in children {
        let owners: Vec<TeamId> = population
            .team(child.team)
            .members
            .iter()
            .map(owner)
            .collect();
        let own = owners.iter().filter(|o| **o == child.parent).count();
        // Copies of a parent are drawn again, and a team may be its own partner. With programs of two teams it is neither.
        if own > 0 && own < owners.len() {
            counts[own - 1] += 1;
        }
    }
    let choices = [4.0, 6.0, 4.0, 1.0];
    let all: Vec<f64> = (1..=4)
        .zip(choices)
        .map(|(k, ways)| ways * INHERIT.powi(k) * (1.0 - INHERIT).powi(4 - k))
        .collect();
    let some: f64 = all.iter().sum();
    let shares: Vec<f64> = all.iter().map(|share| share / some).collect();
    assert_shares("programs of the first parent", &counts, &shares);
}

#[test]
fn programs_mutate_in_the_numbers_that_the_rate_says() {
    for (rate, each) in [(0.0, 0.25), (0.35, 0.35)] {
        let mut params = still();
        params.team.mutate = rate;
        let mut counts = [0; 4];
        for new in seen(&params, |_, parent, child| {
            let pairs = parent.members.iter().zip(&child.members);
            pairs.filter(|(before, after)| before != after).count()
        }) {
            counts[new - 1] += 1;
        }
        let none = (1.0f64 - each).powi(4);
        let binomial = |k: i32, ways: f64| ways * each.powi(k) * (1.0 - each).powi(4 - k);
        // Where none is chosen, one is.
        let shares = [
            binomial(1, 4.0) + none,
            binomial(2, 6.0),
            binomial(3, 4.0),
            binomial(4, 1.0),
        ];
        assert_shares(&format!("programs mutated at {rate}"), &counts, &shares);
    }
}

#[test]
fn programs_vary_with_their_rates() {
    let shape = genes().shape;
    let mut params = still();
    (params.program.code, params.program.add) = (0.5, 0.3);
    let longer = mutated(&params, |before, after| {
        after.instructions.len() > before.instructions.len()
    });
    assert_rate("gaining an instruction", longer.into_iter(), 0.5 * 0.3);

    let mut params = still();
    (params.program.code, params.program.delete) = (0.8, 0.25);
    let shorter = mutated(&params, |before, after| {
        after.instructions.len() < before.instructions.len()
    });
    assert_rate("losing an instruction", shorter.into_iter(), 0.8 * 0.25);

    let mut params = still();
    (params.program.code, params.program.swap) = (1.0, 0.4);
    let swapped = mutated(&params, |before, after| {
        // Alike instructions change places unnoticed: the share of draws of two different ones.
        let code = &before.instructions;
        let pairs = code.iter().flat_map(|a| code.iter().map(move |b| a != b));
        let visible = pairs.filter(|differ| *differ).count() as f64 / 100.0;
        (after.instructions != *code, visible)
    });
    let visible = swapped.iter().map(|(_, v)| v).sum::<f64>() / swapped.len() as f64;
    assert_rate(
        "swapping instructions",
        swapped.into_iter().map(|(s, _)| s),
        0.4 * visible,
    );

    let mut params = still();
    params.program.offset = 0.3;
    let offsets = mutated(&params, |before, after| before.offset != after.offset);
    let others = 1.0 - 1.0 / f64::from(shape.inputs);
    assert_rate("drawing an offset", offsets.into_iter(), 0.3 * others);

    let mut params = still();
    (params.program.action, params.program.atomic) = (0.2, 1.0);
    let actions = mutated(&params, |before, after| before.action != after.action);
    let others = 1.0 - 1.0 / f64::from(shape.atomic_actions());
    assert_rate("drawing an action", actions.into_iter(), 0.2 * others);

    let mut params = still();
    (params.program.action, params.program.atomic) = (1.0, 0.7);
    let teams = mutated(&params, |_, after| !after.is_atomic());
    assert_rate("leading to a team", teams.into_iter(), 0.3);
}

#[test]
fn an_instruction_changes_in_each_of_its_parts_as_often() {
    let mut params = still();
    (params.program.code, params.program.change) = (1.0, 1.0);
    // A new instruction, destination or operand may be the old one. Operations tell a new instruction.
    let ops = genes().ops.len() as f64;
    let fresh = mutated(&params, |before, after| {
        let pairs = before.instructions.iter().zip(&after.instructions);
        pairs.into_iter().any(|(a, b)| a.op != b.op)
    });
    assert_rate(
        "a new operation",
        fresh.into_iter(),
        0.25 * (1.0 - 1.0 / ops),
    );
}

#[test]
fn constants_change_and_flip_with_their_rates() {
    let mut params = still();
    (params.constants.mutate, params.constants.flip) = (0.3, 0.2);
    let look = |before: &Program, after: &Program| -> Option<Vec<(bool, f64)>> {
        let pairs = before
            .constants
            .values()
            .iter()
            .zip(after.constants.values().iter());
        let nonzero = pairs.filter(|(a, _)| **a != 0.0);
        let factors: Vec<_> = nonzero
            .map(|(a, b)| (a.to_bits() != b.to_bits(), f64::from(*b) / f64::from(*a)))
            .collect();
        (!factors.is_empty()).then_some(factors)
    };
    let found: Vec<_> = mutated(&params, look).into_iter().flatten().collect();
    let changed = |factors: &Vec<(bool, f64)>| factors.iter().any(|(changed, _)| *changed);
    assert_rate("constants", found.iter().map(changed), 0.3);
    let factors = || {
        found
            .iter()
            .filter(|f| changed(f))
            .flatten()
            .map(|(_, x)| *x)
    };
    // Constants of one program flip one by one.
    assert_rate("signs", factors().map(|x| x < 0.0), 0.2);
    let (low, high) = (params.constants.factor_min, params.constants.factor_max);
    let mut counts: BTreeMap<u32, u32> = (0..10).map(|k| (k, 0)).collect();
    for factor in factors() {
        let place = (factor.abs() - low) / (high - low) * 10.0;
        *counts.entry((place.max(0.0) as u32).min(9)).or_default() += 1;
        assert!(
            (low - 1e-6..=high + 1e-6).contains(&factor.abs()),
            "{factor}"
        );
    }
    let counts: Vec<u32> = counts.into_values().collect();
    assert_shares("sizes of factors", &counts, &[0.1; 10]);
}
