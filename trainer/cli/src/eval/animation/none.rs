//! A build without MuJoCo's renderer.

use std::path::Path;

use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::Setup;

use super::size::Size;

/// An animation, of which this build has none.
pub(crate) enum Animation {}

impl Animation {
    pub(crate) fn open(_: &Path, _: &Setup, _: Size) -> Result<Self, Failure> {
        Err(Failure::usage(anyhow::anyhow!(
            "--animate: this program is built without MuJoCo's renderer; build it by \
             cargo build --release -p tpg --features render, or take --view OUT.html"
        )))
    }

    pub(crate) fn write(self, _: &Setup) -> Result<(), Failure> {
        match self {}
    }
}
