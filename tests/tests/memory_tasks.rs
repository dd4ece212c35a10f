//! The memory tasks compute what POPGym and bsuite compute.
//!
//! `scripts/memory-golden.py` recorded the episodes in `golden/memory.json`. Card games and memory chains are compared in every
//! bit. Plants are compared to a rounding error: their sine comes from `libm` here and from NumPy there.

use serde::Deserialize;
use tpg_runtime::{Action, HostAgent, Policy, Restore};
use tpg_tasks::eval::{Arena, Domain, Forgetful, episode_seed, evaluate};
use tpg_tasks::stats::mean;
use tpg_tasks::task::memory::{
    Autoencode, CountRecall, Level, MemoryChain, PositionOnly, RepeatFirst, RepeatPrevious,
};
use tpg_tasks::task::{Task, Wrappers, create};
use tpg_tests::golden;
use tpg_trainer::config::{Preset, resolve};
use tpg_trainer::session::Session;

#[derive(Deserialize)]
struct Episodes {
    games: Vec<Game>,
    plants: Vec<Plant>,
    chains: Vec<Chain>,
}

#[derive(Deserialize)]
struct Game {
    task: String,
    orders: Vec<Vec<u16>>,
    limit: u32,
    observations: Vec<Vec<usize>>,
    actions: Vec<u16>,
    reward: f64,
    signs: String,
}

#[derive(Deserialize)]
struct Plant {
    task: String,
    state: [f64; 4],
    limit: u32,
    steps: Vec<PlantStep>,
}

#[derive(Deserialize)]
struct PlantStep {
    action: f32,
    noise: [f32; 2],
    observation: [f32; 2],
    reward: f64,
    terminated: bool,
}

#[derive(Deserialize)]
struct Chain {
    task: String,
    bits: Vec<u8>,
    query: usize,
    observations: Vec<Vec<f32>>,
    actions: Vec<u16>,
    reward: f64,
    signs: String,
}

fn episodes() -> Episodes {
    let text = std::fs::read_to_string(golden::path("memory.json")).expect("a golden file");
    serde_json::from_str(&text).expect("episodes")
}

fn level(parameter: &str) -> Option<Level> {
    Level::ALL
        .into_iter()
        .find(|level| level.name() == parameter)
}

/// Follows an episode of discrete actions, with what the observations should be.
fn follow(
    task: &mut dyn Task,
    observations: &[Vec<f32>],
    actions: &[u16],
    reward: f64,
    signs: &str,
) {
    let name = task.spec().name.clone();
    let mut seen = vec![f32::NAN; task.spec().inputs.len()];
    let ends = actions.len();
    for (t, expected) in observations.iter().enumerate() {
        task.observe(&mut seen);
        assert_eq!(seen, *expected, "{name}: observation {t}");
        let Some(action) = actions.get(t) else { break };
        let step = task.step(Action::Discrete(*action));
        let expected = match signs.as_bytes()[t] {
            b'+' => reward,
            b'-' => -reward,
            _ => 0.0,
        };
        assert_eq!(
            step.reward.to_bits(),
            expected.to_bits(),
            "{name}: reward {t}"
        );
        assert_eq!(step.terminated, t + 1 == ends, "{name}: end {t}");
    }
}

#[test]
fn card_games_are_those_of_popgym() {
    let games = episodes().games;
    for game in &games {
        let (name, parameter) = game.task.split_once(':').expect("a parameter");
        let [first, rest @ ..] = game.orders.as_slice() else {
            panic!("{}: no cards", game.task);
        };
        let mut task: Box<dyn Task> = match (name, level(parameter)) {
            ("repeat-first", Some(level)) => {
                let mut task = RepeatFirst::new(level);
                task.set_order(first);
                Box::new(task)
            }
            ("repeat-previous", level) => {
                let lag = || RepeatPrevious::with_lag(parameter.parse().expect("a lag"));
                let mut task = level.map_or_else(lag, RepeatPrevious::new);
                task.set_order(first);
                Box::new(task)
            }
            ("autoencode", Some(level)) => {
                let mut task = Autoencode::new(level);
                task.set_order(first);
                Box::new(task)
            }
            ("count-recall", Some(level)) => {
                let mut task = CountRecall::new(level);
                task.set_orders(first, &rest[0]);
                Box::new(task)
            }
            _ => panic!("{}", game.task),
        };
        let spec = task.spec().clone();
        assert_eq!(spec.name, format!("{}-v1", game.task));
        assert_eq!(spec.max_steps, game.limit, "{name}");
        // A number out of n is n elements. The numbers of an observation share its elements by their sizes.
        let sizes: Vec<usize> = match name {
            "autoencode" => vec![2, 4],
            "count-recall" => vec![spec.inputs.len() / 2; 2],
            _ => vec![4],
        };
        let flat = |numbers: &Vec<usize>| -> Vec<f32> {
            let parts = numbers.iter().zip(&sizes);
            parts
                .flat_map(|(number, size)| {
                    (0..*size).map(move |k| f32::from(u8::from(k == *number)))
                })
                .collect()
        };
        let observations: Vec<Vec<f32>> = game.observations.iter().map(flat).collect();
        follow(
            &mut *task,
            &observations,
            &game.actions,
            game.reward,
            &game.signs,
        );
    }
    assert_eq!(games.len(), 15);
}

#[test]
fn memory_chains_are_those_of_bsuite() {
    let chains = episodes().chains;
    for chain in &chains {
        let (name, parameter) = chain.task.split_once(':').expect("a parameter");
        let parameter: u32 = parameter.parse().expect("a number");
        let mut task = match name {
            "memory-len" => MemoryChain::with_length(parameter),
            _ => MemoryChain::with_bits(parameter),
        };
        assert_eq!(task.spec().name, format!("{}-v1", chain.task));
        let bits: Vec<bool> = chain.bits.iter().map(|bit| *bit == 1).collect();
        task.set_cue(&bits, chain.query);
        // What the package shows after the end is left out.
        let observations = &chain.observations[..chain.actions.len()];
        follow(
            &mut task,
            observations,
            &chain.actions,
            chain.reward,
            &chain.signs,
        );
    }
    assert_eq!(chains.len(), 14);
}

#[test]
fn plants_without_velocities_are_those_of_popgym() {
    let plants = episodes().plants;
    let mut steps = 0;
    for plant in &plants {
        let (name, parameter) = plant.task.split_once(':').expect("a parameter");
        let level = level(parameter).expect("a level");
        let mut task = match name {
            "position-only-cartpole" => PositionOnly::cartpole(level),
            "position-only-pendulum" => PositionOnly::pendulum(level),
            "noisy-position-only-cartpole" => PositionOnly::noisy_cartpole(level),
            "noisy-position-only-pendulum" => PositionOnly::noisy_pendulum(level),
            _ => panic!("{name}"),
        };
        assert_eq!(task.spec().name, format!("{}-v1", plant.task));
        assert_eq!(task.spec().max_steps, plant.limit, "{name}");
        task.set_state(plant.state);
        for (t, expected) in plant.steps.iter().enumerate() {
            let torque = [expected.action];
            let step = task.step(if name.ends_with("cartpole") {
                Action::Discrete(u16::from(expected.action > 0.0))
            } else {
                Action::Continuous(&torque)
            });
            task.set_noise(expected.noise);
            let mut seen = [f32::NAN; 2];
            task.observe(&mut seen);
            for (ours, theirs) in seen.iter().zip(expected.observation) {
                assert!(
                    (ours - theirs).abs() <= 1e-6,
                    "{}, step {t}: {ours} {theirs}",
                    plant.task
                );
            }
            let difference = (step.reward - expected.reward).abs();
            assert!(
                difference <= 1e-12,
                "{}, step {t}: {difference}",
                plant.task
            );
            assert_eq!(
                step.terminated, expected.terminated,
                "{}, step {t}",
                plant.task
            );
            steps += 1;
        }
    }
    assert_eq!(plants.len(), 12);
    assert!(steps > 300, "{steps} steps");
}

/// Who learned at length 10 needs its registers, and answers right at length 1000.
#[test]
fn the_preset_learns_a_short_maze_that_holds_for_long_ones() {
    let preset = Preset::find("tmaze-memory").expect("a preset");
    let config = resolve(&preset, None, &[]).expect("complete");
    let mut session = Session::new(config, 2).expect("sensible");
    let mut pool = session.pool(1).expect("an arena");
    for _ in 0..80 {
        session.advance(&mut pool).expect("a generation");
    }
    let champion = session.export_champion().expect("a champion");
    let score = |task: &str, forgets: bool| {
        let task = create(task).expect("a name");
        let wrappers = Wrappers::new(&[], task.spec()).expect("no wrappers");
        let mut arena = Arena::new(task, wrappers);
        let policy = Policy::load(&champion).expect("a policy");
        let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
        let seeds = (0..100).map(|k| episode_seed(Domain::Test, 5, 0, k));
        let episodes = if forgets {
            let mut forgetful = Forgetful::new(agent, Restore::Registers);
            evaluate(&mut arena, &mut forgetful, seeds)
        } else {
            evaluate(&mut arena, &mut *agent, seeds)
        };
        let returns: Vec<f64> = episodes.expect("scored").iter().map(|e| e.total).collect();
        mean(&returns)
    };
    let [short, long] = ["tmaze:10", "tmaze:1000"].map(|task| score(task, false));
    assert!(short >= 1.0 - 1e-9 && long >= 1.0 - 1e-9, "{short} {long}");
    let forgetful = score("tmaze:10", true);
    assert!((0.3..0.7).contains(&forgetful), "{forgetful}");
}

/// Every task of the golden file can be made by its name.
#[test]
fn recorded_tasks_have_names() {
    let all = episodes();
    let names = all.games.iter().map(|game| &game.task);
    let names = names.chain(all.plants.iter().map(|plant| &plant.task));
    for name in names.chain(all.chains.iter().map(|chain| &chain.task)) {
        let task = create(name).expect("a name");
        assert_eq!(task.spec().name, format!("{name}-v1"));
    }
}
