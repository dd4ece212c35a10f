//! MuJoCo at work: compiling a model, one robot's state, and what happens when it fails.

use crate::console::{note, one_line};
use crate::exit_status::Status;
use crate::task::{Step, Terms};
use mujoco_rs::{
    error::MjModelError,
    prelude::{MjData, MjLogMessage, MjModel, MjtLogLevel, MjtObjBase, set_log_handler},
    util::assert_mujoco_version,
};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, Once, PoisonError};

/// Compiles a model, as nothing else may: MuJoCo is kept from writing files first.
pub(super) fn compile(
    read: impl FnOnce() -> Result<MjModel, MjModelError>,
) -> Result<Arc<MjModel>, String> {
    silence();
    Ok(Arc::new(read().map_err(one_line)?))
}

/// Keeps MuJoCo from writing its log file into the working directory; once, before anything else of MuJoCo runs.
fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        assert_mujoco_version();
        // SAFETY: no other thread may use MuJoCo meanwhile. This crate uses it through `compile` alone, which
        // comes here first, and `call_once` holds back every other thread until the handler is in place.
        unsafe { set_log_handler(report) };
    });
}

thread_local! {
    /// The model that this thread is simulating, for the message of a fatal error.
    static SIMULATED: Cell<&'static str> = const { Cell::new("") };
}

/// Ends the process when MuJoCo cannot go on: it calls this from C, through which no panic may pass, and would end the
/// process itself afterwards. Warnings are counted in the state, where [`Sim::run`] finds them.
fn report(message: &MjLogMessage) {
    if message.level() == MjtLogLevel::mjLOG_ERROR {
        let (model, reason) = (SIMULATED.get(), message.subject());
        note(format_args!(
            "error: MuJoCo cannot go on with the model {model}: {reason}; change the model as this says (its memory is \
             <size memory=\"...\"/>), then start again or go on with --resume"
        ));
        std::process::exit(Status::Peer.code().into());
    }
}

/// Keeps a model's name for the life of the process, once for each name.
fn keep(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = Box::leak(name.into());
    names.insert(kept);
    kept
}

/// How a simulation failed.
#[derive(Debug, Clone, Copy)]
enum Failure {
    /// MuJoCo's warning of this number, about this coordinate, degree of freedom or control.
    Warning { kind: usize, index: i32 },
    /// The task's reward was not finite.
    Reward,
}

/// The state of one simulated robot.
#[derive(Debug)]
pub(super) struct Sim {
    pub(super) data: MjData<Arc<MjModel>>,
    frame_skip: u32,
    /// What messages call the model.
    name: &'static str,
    /// Control steps since the reset.
    steps: u32,
    failure: Option<Failure>,
}

impl Sim {
    /// Makes a robot out of a compiled model, which messages call by this name.
    pub(super) fn with_model(model: Arc<MjModel>, name: &str, frame_skip: u32) -> Self {
        let name = keep(name);
        SIMULATED.set(name);
        Self {
            data: MjData::new(model),
            frame_skip,
            name,
            steps: 0,
            failure: None,
        }
    }

    /// Starts from a state that `place` makes out of the model's initial positions and of velocities of zero.
    ///
    /// Everything else that MuJoCo carries from step to step, its warm start and its warnings too, starts afresh.
    pub(super) fn reset(&mut self, place: impl FnOnce(&mut MjData<Arc<MjModel>>)) {
        SIMULATED.set(self.name);
        (self.steps, self.failure) = (0, None);
        self.data.reset();
        place(&mut self.data);
        self.data.forward();
    }

    /// Advances by one control step under the control that the state holds, and says whether the state is still good.
    ///
    /// MuJoCo answers a bad state by putting the robot back to the start in the middle of the episode, a jump that
    /// evolution would learn to exploit; the counts of its warnings tell. No `forward` follows the last step: Gymnasium
    /// reads quantities of one step of physics before, and so do the tasks.
    pub(super) fn run(&mut self) -> bool {
        SIMULATED.set(self.name);
        self.steps = self.steps.saturating_add(1);
        for _ in 0..self.frame_skip {
            self.data.step();
        }
        let warnings = self.data.warning();
        let failed = FATAL.into_iter().find(|&kind| warnings[kind].number != 0);
        if let (Some(kind), None) = (failed, self.failure) {
            let index = warnings[kind].lastinfo;
            self.failure = Some(Failure::Warning { kind, index });
        }
        failed.is_none()
    }

    /// Notes that the reward of this step was not finite.
    pub(super) fn fail_reward(&mut self) {
        self.failure = Some(Failure::Reward);
    }

    /// Why the simulation failed, if it did.
    pub(super) fn instability(&self) -> Option<String> {
        let reason = match self.failure? {
            Failure::Reward => "the reward is not finite".into(),
            Failure::Warning { kind, index } => warning(kind, index, self.data.model()),
        };
        Some(format!("{reason}, step {}", self.steps))
    }
}

/// mjWARN_BADQPOS, BADQVEL, BADQACC and BADCTRL: the state or the control was not finite or huge.
const FATAL: std::ops::Range<usize> = 3..7;

/// One of MuJoCo's warnings in its own words, with the object that it is about.
fn warning(kind: usize, index: i32, model: &MjModel) -> String {
    let (word, unit) = match kind {
        3 => ("BADQPOS", "coordinate"),
        4 => ("BADQVEL", "DOF"),
        5 => ("BADQACC", "DOF"),
        _ => ("BADCTRL", "control"),
    };
    let joint = (kind == 4 || kind == 5)
        .then(|| {
            let owner = model.dof_jntid().get(usize::try_from(index).ok()?)?;
            model.id_to_name(MjtObjBase::mjOBJ_JOINT, usize::try_from(*owner).ok()?)
        })
        .flatten();
    let joint = joint.map_or_else(String::new, |joint| format!(" (joint {joint:?})"));
    format!("{word} at {unit} {index}{joint}")
}

/// The outcome of a step in which the simulation failed.
pub(super) const UNSTABLE: Step = Step {
    reward: 0.0,
    terms: Terms {
        alive: 0.0,
        control: 0.0,
    },
    terminated: true,
    unstable: true,
};
