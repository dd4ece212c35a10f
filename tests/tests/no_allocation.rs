//! After its first episode no task allocates: not when it is reset, observed or stepped. Nor does an agent in it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use tpg_runtime::{Action, HostAgent, Policy, Reset};
use tpg_tasks::eval::Arena;
use tpg_tasks::task::{ActionSpace, Rng, Task, create, names};
use tpg_trainer::config::{Preset, Settings, resolve};
use tpg_trainer::front_end::{Moments, Recorded, Recorder};
use tpg_trainer::session::Session;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is handed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and the pointer came from the system's allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn episode(task: &mut dyn Task, observation: &mut [f32], seed: u64) {
    task.reset(&mut Rng::new(seed));
    for t in 0..50u16 {
        let values = [f32::from(t % 5) / 2.0 - 1.0; 17];
        let action = match task.spec().actions {
            ActionSpace::Discrete(count) => Action::Discrete(t % count),
            ActionSpace::Continuous { len, .. } => Action::Continuous(&values[..usize::from(len)]),
        };
        task.observe(observation);
        task.step(action);
    }
}

#[test]
fn no_task_allocates_after_its_first_episode() {
    let crane = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../docs/examples/crane/crane.toml"
    );
    let described = cfg!(feature = "mujoco").then_some(crane);
    for name in names().iter().copied().chain(described) {
        let mut task = create(name).unwrap_or_else(|error| panic!("{error}"));
        let mut observation = vec![0.0; task.spec().inputs.len()];
        episode(&mut *task, &mut observation, 1);
        let before = ALLOCATIONS.get();
        episode(&mut *task, &mut observation, 2);
        assert_eq!(ALLOCATIONS.get() - before, 0, "{name}");
    }
}

/// The whole loop of an episode: task, wrappers and the agent's decisions, recorded or not.
#[test]
fn no_episode_of_an_agent_allocates() {
    let robots = ["hopper-sr-sm-b23", "half-cheetah-sr-mm"];
    let native = ["cartpole-sr-sm-whole-b13", "pendulum-per-episode"];
    let robots = robots.iter().filter(|_| cfg!(feature = "mujoco"));
    for name in native.iter().chain(robots) {
        let preset = Preset::find(name).expect("a preset");
        let sets = ["evolution.population=12", "evaluation.episodes=1"].map(str::to_owned);
        let config = resolve(&preset, None, &sets).expect("known keys");
        let settings = Settings::new(&config).expect("a sound configuration");
        let mut session = Session::new(config, 3).expect("the same");
        let mut pool = session.pool(1).expect("the task");
        session
            .advance(&mut pool)
            .expect("teams that can be scored");
        let blob = session.export_champion().expect("a champion");
        let policy = Policy::load(&blob).expect("a sound policy");
        let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
        let mut arena = settings.arena().expect("the task");
        let mut allocations = |controller: &mut dyn FnMut(&mut Arena, u64)| {
            controller(&mut arena, 1);
            let before = ALLOCATIONS.get();
            controller(&mut arena, 2);
            ALLOCATIONS.get() - before
        };
        let plain = allocations(&mut |arena, seed| {
            (arena.episode(&mut *agent, Reset::Episode, seed)).expect("the right observation");
        });
        assert_eq!(plain, 0, "{name}");
        let spec = settings.arena().expect("the task").task().spec().clone();
        let inputs = usize::from(policy.header().observation_len);
        let mut recorder = Recorder::new(inputs, spec.actions, spec.max_steps);
        let mut recorded = Recorded {
            inner: &mut *agent,
            recorder: &mut recorder,
        };
        let watched = allocations(&mut |arena, seed| {
            (arena.episode(&mut recorded, Reset::Episode, seed)).expect("the right observation");
        });
        assert_eq!(watched, 0, "{name}, recorded");
        assert!(recorder.finish().moments != Moments::new(inputs), "{name}");
    }
}

/// What `tpg hil --record` does in a step. The loop's plant is built with MuJoCo.
#[cfg(feature = "mujoco")]
#[test]
fn no_recorded_step_of_the_loop_allocates() {
    use std::time::{Duration, Instant};
    use tpg_sim_bridge::record::{RecordPath, Recorder, Subject};
    use tpg_sim_bridge::{Source, Step};
    let folder = tempfile::tempdir().expect("a folder");
    let channel = |name: &str| (name.to_owned(), "1".to_owned());
    for name in ["loop.mcap", "loop.csv"] {
        let path = folder.path().join(name);
        let place: RecordPath = path.to_str().expect("text").parse().expect("a form");
        let subject = Subject {
            inputs: vec![channel("a"), channel("b")],
            outputs: vec![channel("c")],
            period_us: 8_000,
            max_steps: 1_000,
            ..Subject::default()
        };
        let mut recorder = Recorder::create(&place, subject).expect("a file");
        for episode in 0..2 {
            recorder.begin_episode().expect("written");
            let before = ALLOCATIONS.get();
            for step in 0..1_000 {
                let missed = step % 10 == 9;
                let facts = Step {
                    sent: Instant::now(),
                    latency: (!missed).then_some(Duration::from_micros(3)),
                    source: if missed { Source::Held } else { Source::Answer },
                };
                recorder.keep(&[1.0, f32::NAN], Action::Continuous(&[0.5]), 7, facts);
            }
            assert_eq!(ALLOCATIONS.get() - before, 0, "{name}, episode {episode}");
        }
        recorder.finish().expect("written");
        assert!(
            std::fs::metadata(&path).expect("a file").len() > 40_000,
            "{name}"
        );
    }
}
