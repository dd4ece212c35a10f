//! The keys of a file that describes a task.

use super::keys::{Load, overlay, table};
use crate::console::one_line;
use serde::Deserialize;
use std::collections::BTreeSet;

/// A task as its file describes it; docs/custom-tasks.md explains every key.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Description {
    pub name: String,
    pub model: String,
    pub frame_skip: u32,
    pub max_steps: u32,
    pub period_us: Option<u32>,
    #[serde(default = "once")]
    pub action_repeat: u32,
    #[serde(default)]
    pub leave_out: Vec<Part>,
    #[serde(default)]
    pub observation: Vec<Observation>,
    #[serde(default)]
    pub actuator: Vec<Actuator>,
    #[serde(default)]
    pub action: Vec<Action>,
    #[serde(default)]
    pub reward: Vec<Reward>,
    #[serde(default)]
    pub termination: Vec<Termination>,
    #[serde(default)]
    pub goal: Vec<Goal>,
    #[serde(default)]
    pub reset: Reset,
    #[serde(default)]
    pub randomize: Scales,
}

fn once() -> u32 {
    1
}

/// What MuJoCo need not compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Part {
    Contacts,
    Islands,
    Sensors,
}

#[derive(Debug, Deserialize)]
pub(super) struct Observation {
    pub source: Option<String>,
    pub expression: Option<String>,
    pub name: String,
    pub unit: String,
    pub velocity: Option<bool>,
    pub clip: Option<f64>,
    /// Lowest and highest value, to be told to whoever uses the policy.
    pub range: Option<[f64; 2]>,
    /// The most by which the value is off in an episode, above or below.
    #[serde(default)]
    pub offset: f64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Actuator {
    pub name: String,
    /// Which one it is in the model, where the name does not say so.
    pub actuator: Option<String>,
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub unit: Option<String>,
    pub rate_limit: Option<f64>,
}

/// One of several actions to choose from.
#[derive(Debug, Deserialize)]
pub(super) struct Action {
    pub name: String,
    pub controls: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RewardKind {
    Constant,
    Alive,
    Linear,
    Square,
    Velocity,
    ControlCost,
}

/// The floating-point numbers that a term is worked out in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Precision {
    #[default]
    F64,
    F32,
}

/// What a term pays for, besides the task itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum CountsAs {
    Alive,
    Control,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Reward {
    pub kind: Option<RewardKind>,
    pub expression: Option<String>,
    pub weight: Option<f64>,
    pub source: Option<String>,
    pub target: Option<f64>,
    #[serde(default)]
    pub precision: Precision,
    pub counts_as: Option<CountsAs>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Termination {
    pub source: Option<String>,
    pub expression: Option<String>,
    pub below: Option<f64>,
    pub above: Option<f64>,
    pub at_or_below: Option<f64>,
    pub at_or_above: Option<f64>,
}

/// A number that is drawn for each episode.
#[derive(Debug, Deserialize)]
pub(super) struct Goal {
    pub name: String,
    pub low: f64,
    pub high: f64,
}

/// The ranges of the factors by which an episode's model differs from its file.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Scales {
    pub mass: Option<[f64; 2]>,
    pub inertia: Option<[f64; 2]>,
    pub friction: Option<[f64; 2]>,
    pub damping: Option<[f64; 2]>,
    pub actuator_gain: Option<[f64; 2]>,
    pub gravity: Option<[f64; 2]>,
}

impl Scales {
    /// The ranges with their keys.
    pub(super) fn all(&self) -> [(&'static str, Option<[f64; 2]>); 6] {
        [
            ("mass", self.mass),
            ("inertia", self.inertia),
            ("friction", self.friction),
            ("damping", self.damping),
            ("actuator-gain", self.actuator_gain),
            ("gravity", self.gravity),
        ]
    }

    fn check(&self) -> Result<(), String> {
        for (key, range) in self.all() {
            let Some([low, high]) = range else { continue };
            check_range(&format!("randomize.{key}"), [low, high])?;
            let massive = key == "mass" || key == "inertia";
            if low < 0.0 || massive && low == 0.0 {
                let bound = if massive { "above 0" } else { "0 or more" };
                return Err(format!(
                    "randomize.{key} goes from {low}: a factor here is {bound}"
                ));
            }
        }
        Ok(())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Distribution {
    /// Within plus and minus the noise.
    #[default]
    Uniform,
    /// With the noise as standard deviation.
    Normal,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Reset {
    pub keyframe: Option<String>,
    #[serde(default)]
    pub position_noise: f64,
    #[serde(default)]
    pub velocity_noise: f64,
    pub orientation_noise: Option<f64>,
    #[serde(default)]
    pub position_distribution: Distribution,
    #[serde(default)]
    pub velocity_distribution: Distribution,
    #[serde(default)]
    pub joint: Vec<Joint>,
    pub redraw_until: Option<String>,
}

/// Where one joint starts.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Joint {
    pub joint: String,
    pub position: Option<Place>,
    pub velocity: Option<Place>,
    pub position_noise: Option<f64>,
    pub velocity_noise: Option<f64>,
}

/// A value, or the range that it is drawn from.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(super) enum Place {
    At(f64),
    Within([f64; 2]),
}

impl Description {
    /// Reads the text of a file and checks what can be checked without the model.
    pub(super) fn read(text: &str, load: &Load<'_>) -> Result<Self, String> {
        let table = table(text)?;
        let read: Self = if table.contains_key("like") {
            overlay(table, load, 0)?.try_into().map_err(one_line)?
        } else {
            // From the text, so that messages show the line.
            toml::from_str(text).map_err(one_line)?
        };
        read.check()?;
        Ok(read)
    }

    /// Drops what makes the robot of one episode differ from that of another.
    pub(super) fn stop_randomizing(&mut self) {
        self.randomize = Scales::default();
        for observation in &mut self.observation {
            observation.offset = 0.0;
        }
    }

    fn check(&self) -> Result<(), String> {
        let name = self.name.as_bytes();
        let version = self
            .name
            .rsplit_once("-v")
            .map_or("", |(_, version)| version);
        let named = name.first().is_some_and(u8::is_ascii_lowercase)
            && name
                .iter()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == b'-')
            && !version.is_empty()
            && version.bytes().all(|c| c.is_ascii_digit());
        if !named || name.len() > 64 {
            return Err(format!(
                "name = {:?}: a task's name is at most 64 lower-case letters, digits and hyphens, and ends in a \
                 version, such as crane-v1",
                self.name
            ));
        }
        for (key, value) in [
            ("frame-skip", self.frame_skip),
            ("max-steps", self.max_steps),
            ("action-repeat", self.action_repeat),
        ] {
            if value == 0 {
                return Err(format!("{key} = 0: must be at least 1"));
            }
        }
        if self.observation.is_empty() || self.actuator.is_empty() {
            return Err("at least one [[observation]] and one [[actuator]] are needed".into());
        }
        for observation in &self.observation {
            for text in [&observation.name, &observation.unit] {
                check_label(text)?;
            }
            check_width("observation.offset", observation.offset)?;
            if let Some([low, high]) = observation.range
                && !(low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY)
            {
                return Err(format!(
                    "observation.range goes from {low} to {high} in {:?}: the lower one must stand first; -inf and inf \
                     leave a side open",
                    observation.name
                ));
            }
            if observation
                .clip
                .is_some_and(|clip| !(clip.is_finite() && clip > 0.0))
            {
                return Err(format!(
                    "observation.clip = {} of {:?}: must be a finite number above 0; leave the key out for no limit",
                    observation.clip.unwrap_or_default(),
                    observation.name
                ));
            }
        }
        if let Some(name) = twice(self.observation.iter().map(|o| o.name.as_str())) {
            return Err(format!(
                "observation.name = {name:?}: two observations have this name; give each its own"
            ));
        }
        if self.reward.is_empty() {
            return Err(
                "there is no [[reward]]: without one every policy scores 0; add at least one term"
                    .into(),
            );
        }
        for actuator in &self.actuator {
            check_label(&actuator.name)?;
            check_label(actuator.unit.as_deref().unwrap_or("1"))?;
        }
        for action in &self.action {
            check_label(&action.name)?;
        }
        if let Some(name) = twice(self.goal.iter().map(|goal| goal.name.as_str())) {
            return Err(format!("goal.name = {name:?}: two goals have this name"));
        }
        for goal in &self.goal {
            check_label(&goal.name)?;
            check_range(&format!("goal {:?}", goal.name), [goal.low, goal.high])?;
        }
        self.randomize.check()?;
        self.reset.check()
    }
}

impl Reset {
    fn check(&self) -> Result<(), String> {
        check_width("reset.position-noise", self.position_noise)?;
        check_width("reset.velocity-noise", self.velocity_noise)?;
        check_width(
            "reset.orientation-noise",
            self.orientation_noise.unwrap_or_default(),
        )?;
        for joint in &self.joint {
            for (key, value) in [
                ("position-noise", joint.position_noise),
                ("velocity-noise", joint.velocity_noise),
            ] {
                check_width(&format!("reset.joint.{key}"), value.unwrap_or_default())?;
            }
            for (key, place) in [("position", joint.position), ("velocity", joint.velocity)] {
                let key = format!("reset.joint.{key} of {:?}", joint.joint);
                match place {
                    Some(Place::At(value)) => {
                        finite(&key, value)?;
                    }
                    Some(Place::Within(range)) => check_range(&key, range)?,
                    None => {}
                }
            }
        }
        Ok(())
    }
}

/// The first text that occurs twice.
fn twice<'a>(texts: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut seen = BTreeSet::new();
    texts.into_iter().find(|text| !seen.insert(*text))
}

/// Refuses a text that a policy's table of channels cannot hold.
fn check_label(text: &str) -> Result<(), String> {
    if text.is_empty() || text.len() > 64 || text.chars().any(char::is_control) {
        return Err(format!(
            "{text:?}: names and units are 1 to 64 bytes without tabs and line ends"
        ));
    }
    Ok(())
}

fn check_width(key: &str, value: f64) -> Result<(), String> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(format!(
            "{key} = {value}: must be a finite number, 0 or more"
        ))
    }
}

/// Refuses a range that holds no number.
fn check_range(key: &str, [low, high]: [f64; 2]) -> Result<(), String> {
    if low.is_finite() && high.is_finite() && low <= high {
        Ok(())
    } else {
        Err(format!(
            "{key} goes from {low} to {high}: both must be finite, the lower one first"
        ))
    }
}

/// Refuses a value that is not finite.
pub(super) fn finite(key: &str, value: f64) -> Result<f64, String> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("{key} = {value}: must be finite"))
    }
}
