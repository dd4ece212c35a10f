//! A build with MuJoCo's renderer.

use std::fs::File;
use std::path::Path;
use std::time::Instant;

use tpg_tasks::animation::Animator;
use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Fault as _};
use tpg_tasks::score::Setup;

use super::size::Size;

/// An animation to be written: renderer and file are opened before episodes run, so that they do not run in vain.
pub(crate) struct Animation<'a> {
    animator: Animator,
    path: &'a Path,
    file: File,
}

impl<'a> Animation<'a> {
    pub(crate) fn open(path: &'a Path, setup: &Setup, Size(size): Size) -> Result<Self, Failure> {
        if !(path.extension()).is_some_and(|ending| ending.eq_ignore_ascii_case("gif")) {
            let path = path.display();
            return Err(Failure::usage(anyhow::anyhow!(
                "--animate {path}: animations are GIFs, so the file's name has to end in .gif"
            )));
        }
        let animator = Animator::new(setup, size)?;
        let file = File::create(path).or_unwritable(path)?;
        Ok(Animation {
            animator,
            path,
            file,
        })
    }

    /// Draws the first episode and says where.
    pub(crate) fn write(self, setup: &Setup) -> Result<(), Failure> {
        let began = Instant::now();
        let shown = self.animator.write(setup, self.file, self.path)?;
        let took = began.elapsed().as_secs_f64();
        let (path, seconds, pictures) = (self.path.display(), shown.seconds, shown.pictures);
        note(format_args!(
            "animation: {path} shows {seconds:.1} s of the first episode in {pictures} pictures, drawn in {took:.1} s"
        ));
        Ok(())
    }
}
