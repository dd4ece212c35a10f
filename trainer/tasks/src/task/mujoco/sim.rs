//! What the MuJoCo tasks share: one model for the process, one state for each instance.

use crate::console::{note, one_line};
use crate::task::{Step, Terms};
use mujoco_rs::{
    error::MjModelError,
    prelude::{MjData, MjLogMessage, MjModel, MjtDisableBit, MjtLogLevel, set_log_handler},
    util::assert_mujoco_version,
};
use std::sync::{Arc, Once, OnceLock};
use tpg_runtime::Action;

/// What MuJoCo need not compute. Nothing reads sensors, and constraint islands cost more than they save in one small
/// robot. Leaving both out changes no bit of the physics.
const IDLE: i32 = MjtDisableBit::mjDSBL_ISLAND as i32 | MjtDisableBit::mjDSBL_SENSOR as i32;

/// A robot's model, compiled when it is first needed and shared by all its instances.
pub(super) struct Model {
    xml: &'static str,
    disabled: i32,
    compiled: OnceLock<Arc<MjModel>>,
}

impl Model {
    /// Describes a model whose bodies may touch.
    pub(super) const fn new(xml: &'static str) -> Self {
        Self {
            xml,
            disabled: IDLE,
            compiled: OnceLock::new(),
        }
    }

    /// Describes a model in which no pair of bodies can touch, so that looking for contacts is wasted.
    pub(super) const fn without_contacts(xml: &'static str) -> Self {
        Self {
            xml,
            disabled: IDLE | MjtDisableBit::mjDSBL_CONTACT as i32,
            compiled: OnceLock::new(),
        }
    }

    fn get(&self) -> Arc<MjModel> {
        let compile = || {
            silence();
            // The build checked the file against its hash, so only a broken MuJoCo can refuse it.
            let mut model =
                MjModel::from_xml_string(self.xml).expect("MuJoCo compiles Gymnasium's model");
            model.opt_mut().disableflags |= self.disabled;
            Arc::new(model)
        };
        Arc::clone(self.compiled.get_or_init(compile))
    }
}

/// Compiles a user's model, whose options stay as they are.
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
        // SAFETY: no other thread may use MuJoCo meanwhile. This crate uses it through `Model::get` and `compile` alone, which
        // come here first, and `call_once` holds back every other thread until the handler is in place.
        unsafe { set_log_handler(report) };
    });
}

/// Tells why MuJoCo is about to end the process. Warnings are counted in the state, where [`Sim::advance`] finds them.
fn report(message: &MjLogMessage) {
    if message.level() == MjtLogLevel::mjLOG_ERROR {
        note(format_args!("error: MuJoCo: {}", message.subject()));
    }
}

/// The state of one simulated robot.
#[derive(Debug)]
pub(super) struct Sim {
    pub(super) data: MjData<Arc<MjModel>>,
    frame_skip: u32,
}

impl Sim {
    /// Makes a robot that takes `frame_skip` steps of physics for each control step.
    pub(super) fn new(model: &Model, frame_skip: u32) -> Self {
        Self {
            data: MjData::new(model.get()),
            frame_skip,
        }
    }

    /// Makes a robot out of a model that this one alone uses.
    pub(super) fn with_model(model: Arc<MjModel>, frame_skip: u32) -> Result<Self, String> {
        let data = MjData::try_new(model).map_err(|error| error.to_string())?;
        Ok(Self { data, frame_skip })
    }

    /// Simulated seconds of one control step, multiplied as Gymnasium does.
    pub(super) fn period(&self) -> f64 {
        self.data.model().opt().timestep * f64::from(self.frame_skip)
    }

    /// Starts from a state that `place` makes out of the model's initial positions and of velocities of zero.
    ///
    /// Everything else that MuJoCo carries from step to step, its warm start and its warnings too, starts afresh.
    pub(super) fn reset(&mut self, place: impl FnOnce(&mut MjData<Arc<MjModel>>)) {
        self.data.reset();
        place(&mut self.data);
        self.data.forward();
    }

    /// Advances by one control step and says whether the state is still good.
    ///
    /// MuJoCo answers a bad state by putting the robot back to the start in the middle of the episode, a jump that
    /// evolution would learn to exploit; the counts of its warnings tell. No `forward` follows the last step: Gymnasium
    /// reads quantities of one step of physics before, and so do the tasks.
    pub(super) fn advance(&mut self, control: &[f32]) -> bool {
        for (out, &value) in self.data.ctrl_mut().iter_mut().zip(control) {
            *out = f64::from(value);
        }
        self.run()
    }

    /// Advances like [`advance`](Self::advance), under the control that the state holds already.
    pub(super) fn run(&mut self) -> bool {
        for _ in 0..self.frame_skip {
            self.data.step();
        }
        // mjWARN_BADQPOS, BADQVEL, BADQACC and BADCTRL.
        self.data.warning()[3..=6]
            .iter()
            .all(|warning| warning.number == 0)
    }
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

/// The values of an action, zero where it has none.
pub(super) fn control<const N: usize>(action: Action<'_>) -> [f32; N] {
    let values = match action {
        Action::Continuous(values) => values,
        Action::Discrete(_) => &[],
    };
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Squares through C's `pow`, as NumPy's `**` does; the bits can differ from those of a product.
///
/// The black box keeps the compiler from turning the call into that product.
pub(super) fn square(x: f64) -> f64 {
    x.powf(std::hint::black_box(2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Rng;
    use crate::task::mujoco::{double_pendulum, half_cheetah, hopper};

    /// Everything that the tasks read, as bits.
    fn bits(data: &MjData<Arc<MjModel>>) -> Vec<u64> {
        let parts = [
            data.qpos(),
            data.qvel(),
            data.qacc(),
            data.qacc_warmstart(),
            data.qfrc_constraint(),
            data.site_xpos().as_flattened(),
        ];
        parts.concat().iter().map(|x| x.to_bits()).collect()
    }

    /// Two robots, one whose model computes everything, take the same steps, restarts included.
    fn assert_same_bits(model: &Model, name: &str) {
        const STEPS: u32 = 6_000;
        const EPISODE: u32 = 400;
        silence();
        let complete = Arc::new(MjModel::from_xml_string(model.xml).expect("a model"));
        assert_eq!(complete.opt().disableflags, 0, "{name} as it is described");
        let lean = model.get();
        assert_ne!(lean.opt().disableflags, 0, "{name}");
        let mut robots = [MjData::new(complete), MjData::new(lean)];
        let mut rng = Rng::new(3);
        let mut touched = 0;
        for step in 0..STEPS {
            if step % EPISODE == 0 {
                let speed = rng.uniform(-3.0, 3.0);
                for data in &mut robots {
                    data.reset();
                    data.qvel_mut().fill(speed);
                    data.forward();
                }
            }
            let control = rng.uniform(-1.0, 1.0);
            let [a, b] = robots.each_mut().map(|data| {
                for (k, out) in data.ctrl_mut().iter_mut().enumerate() {
                    *out = if k % 2 == 0 { control } else { -control };
                }
                data.step();
                bits(data)
            });
            assert_eq!(a, b, "{name} at step {step}");
            touched += robots[0].ncon();
        }
        let collides = model.disabled & MjtDisableBit::mjDSBL_CONTACT as i32 == 0;
        assert_eq!(touched > 0, collides, "{name} and its contacts");
    }

    #[test]
    fn what_is_left_out_changes_no_bit() {
        assert_same_bits(&hopper::MODEL, "hopper");
        assert_same_bits(&half_cheetah::MODEL, "half-cheetah");
        assert_same_bits(&double_pendulum::MODEL, "inverted-double-pendulum");
    }
}
