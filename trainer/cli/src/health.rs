//! `tpg eval --health`: whether sensors show what the policy's own model expects.

use serde_json::{Value, json};
use tpg_runtime::HostAgent;
use tpg_runtime::health::THRESHOLD;
use tpg_tasks::eval::{ChannelHealth, Watched, evaluate};
use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::Setup;

/// The health of each channel that the policy's model predicts.
pub(crate) struct Health(Vec<ChannelHealth>);

impl Health {
    /// Runs the episodes of a setup with a watched agent. Its decisions are those of any other.
    pub(crate) fn of(setup: &Setup, agent: Box<HostAgent<'_>>) -> Result<Self, Failure> {
        let watched = Watched::new(agent).ok_or_else(|| {
            Failure::usage(anyhow::anyhow!(
                "{} has no model that predicts its inputs, so --health has nothing to compare with; train with \
                 front-end.belief = \"learned\"",
                setup.file.display()
            ))
        })?;
        let mut arena = setup.arena()?;
        let mut controller = setup.disturbed(&arena, watched)?;
        evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
        Ok(Health(controller.into_inner().finish()))
    }

    pub(crate) fn json(&self) -> Value {
        json!({ "threshold": THRESHOLD, "channels": self.0 })
    }

    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "health         share of changes that the model does not explain, worst of an episode; above {THRESHOLD} is suspect"
        );
        for channel in &self.0 {
            let share =
                |share: Option<f32>| share.map_or("-".into(), |share| format!("{share:.2}"));
            let most = channel
                .worst
                .iter()
                .copied()
                .flatten()
                .max_by(f32::total_cmp);
            let episodes = channel.worst.iter().flatten().count();
            text += &format!(
                "\n  {:>3} {:<30} median {:>5}, most {:>5}, suspect in {} of {episodes} episodes",
                channel.input,
                channel.name,
                share(channel.median()),
                share(most),
                channel.suspect
            );
        }
        text
    }
}
