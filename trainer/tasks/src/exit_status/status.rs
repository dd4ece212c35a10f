//! The exit statuses themselves.
//!
//! `tpg-controller` builds without this crate. The bridge then compiles this file as a module of its own, so it may use
//! nothing but the standard library.

use std::process::ExitCode;

/// Exit status of a command; the numbers are part of the commands' interface and never change their meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// The command did what it was asked to do.
    Fine = 0,
    /// A defect, or a failing system. A panic ends with a status of its own, 101.
    OurFault = 1,
    /// The command line or the configuration is wrong, or an output cannot be written.
    Usage = 2,
    /// An input file cannot be read, or its content cannot be used.
    BadInput = 3,
    /// The simulator failed, or the other process or the board of a loop.
    Peer = 4,
    /// The command was carried out, but a requirement of the user does not hold.
    Unmet = 5,
    /// A signal ended the command; training and experiments have written a checkpoint.
    Interrupted = 130,
}

impl Status {
    /// Every status, in ascending order of its number.
    pub const ALL: [Self; 7] = [
        Self::Fine,
        Self::OurFault,
        Self::Usage,
        Self::BadInput,
        Self::Peer,
        Self::Unmet,
        Self::Interrupted,
    ];

    /// The number that the shell sees.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The status with this number, if there is one.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.code() == code)
    }

    /// What the status means, as help texts say it.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Fine => "done",
            Self::OurFault => "our fault",
            Self::Usage => "usage, configuration, or an output that cannot be written",
            Self::BadInput => "an input that cannot be read or used",
            Self::Peer => "the simulator, the other process or the board failed",
            Self::Unmet => "a requirement does not hold",
            Self::Interrupted => {
                "interrupted, with a checkpoint where there is something to go on with"
            }
        }
    }

    /// The sentence that lists all of them: for help texts and documents.
    #[must_use]
    pub fn sentence() -> String {
        let list = Self::ALL.map(|status| format!("{} {}", status.code(), status.meaning()));
        format!("Exit status: {}.", list.join("; "))
    }

    /// The end of a command's `--help`: the statuses, then its examples.
    #[must_use]
    pub fn help(examples: &str) -> String {
        format!("{}\n\n{examples}", Self::sentence())
    }
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        ExitCode::from(status.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_names_its_status() {
        for status in Status::ALL {
            assert_eq!(Status::from_code(status.code()), Some(status));
        }
        assert_eq!(Status::from_code(101), None);
    }
}
