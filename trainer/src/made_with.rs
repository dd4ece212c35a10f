//! Versions that results depend on.

use serde::{Deserialize, Serialize};

/// What made the files of a folder: the folders of runs and of experiments say so of themselves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MadeWith {
    /// Form of the folder; raised when its files change their meaning.
    pub format: u32,
    /// Version of the trainer.
    pub tpg: String,
    /// 8 hexadecimal digits: fingerprint of the instruction set.
    pub fingerprint: String,
    /// Version of the policies' file format.
    pub blob_format: u16,
    /// Version of the simulator, or `none`.
    pub mujoco: String,
}

impl MadeWith {
    /// What this build makes, in folders of this form.
    #[must_use]
    pub fn this_build(format: u32) -> Self {
        MadeWith {
            format,
            tpg: env!("CARGO_PKG_VERSION").into(),
            fingerprint: format!("{:08x}", tpg_runtime::isa::FINGERPRINT),
            blob_format: tpg_runtime::blob::VERSION,
            mujoco: tpg_tasks::task::simulator_version(),
        }
    }
}
