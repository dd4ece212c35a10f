//! What the state offsets of a program's instructions stand for.

use tpg_runtime::tables::Program;

use super::plan::Plan;

/// What a state offset stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Location {
    /// A word of the observation window.
    Window(usize),
    /// A scalar register.
    Scalar(usize),
    /// A vector register and an element of it; 0 also stands for the whole register.
    Vector(usize, usize),
    /// A matrix register and an element of it, row by row; 0 also stands for the whole register.
    Matrix(usize, usize),
}

impl Plan<'_> {
    /// What an offset in a program's instructions stands for.
    pub(super) fn location(&self, program: &Program, at: u16) -> Location {
        let at = usize::from(at);
        if at < self.window {
            return Location::Window(at);
        }
        let square = self.width * self.width;
        let [scalars, vectors, _] = program.registers.map(usize::from);
        let offset = at - usize::from(program.state_start);
        if offset < scalars {
            return Location::Scalar(offset);
        }
        let offset = offset - scalars;
        if offset < vectors * self.width {
            return Location::Vector(offset / self.width, offset % self.width);
        }
        let offset = offset - vectors * self.width;
        Location::Matrix(offset / square, offset % square)
    }
}
