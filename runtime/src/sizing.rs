//! Capacities of an agent, from the bytes of its policy, when the firmware is compiled.

use core::fmt;

use crate::blob::{Header, HeaderFault, OLDEST_VERSION, VERSION};
use crate::parts::Resource;

/// What an agent needs for a policy, or offers to one.
///
/// # Examples
/// ```
/// use tpg_runtime::Capacities;
///
/// # const CHAMPION: &[u8] = include_bytes!("../examples/team-memory.tpg");
/// const NEEDED: Capacities = Capacities::of(CHAMPION);
/// const AVAILABLE: Capacities = Capacities { words: 128, programs: 8, teams: 4, streams: 6, ..NEEDED };
/// const _: () = NEEDED.assert_fits(&AVAILABLE);
/// const _: () = assert!(NEEDED.state_bytes() <= 16 * 1024);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capacities {
    /// Vector width. It must be equal; a larger one does not do.
    pub width: usize,
    /// State words.
    pub words: usize,
    /// Programs.
    pub programs: usize,
    /// Teams.
    pub teams: usize,
    /// Random streams of team memory.
    pub streams: usize,
}

impl Capacities {
    /// What the policy in these bytes needs, as its header says.
    ///
    /// Use it in constant expressions. It reads only the header. [`Policy::load`](crate::Policy::load) reports other
    /// faults, such as damage, when the program runs.
    ///
    /// # Panics
    /// If the header is refused or announces another length than that of `bytes`; in a constant expression this ends
    /// the compilation, with the reason.
    #[must_use]
    #[expect(
        clippy::panic,
        reason = "for constant expressions, where it ends the compilation"
    )]
    pub const fn of(bytes: &[u8]) -> Self {
        let header = match Header::read(bytes) {
            Ok(header) => header,
            Err(fault) => {
                let text = Text::new().text("this is no policy for this build: ");
                let text = match fault {
                    HeaderFault::Short(needed) => text
                        .number(bytes.len() as u64)
                        .text(" bytes are fewer than a header's ")
                        .number(needed as u64),
                    HeaderFault::Magic => text.text("the file does not begin with TPGB"),
                    HeaderFault::Version(version) => text
                        .text("the file has format version ")
                        .number(version as u64)
                        .text(", this build reads versions ")
                        .number(OLDEST_VERSION as u64)
                        .text(" to ")
                        .number(VERSION as u64),
                    HeaderFault::Fingerprint(_) => {
                        text.text("it was made for another instruction set, export it again")
                    }
                    HeaderFault::Field(field) => text
                        .text("its header holds no valid value in field ")
                        .text(field.name()),
                };
                panic!("{}", text.as_str())
            }
        };
        let needed = header.file_bytes();
        if needed != bytes.len() as u64 {
            let text = Text::new()
                .text("the policy is damaged: its header announces ")
                .number(needed)
                .text(" bytes, the file has ")
                .number(bytes.len() as u64);
            panic!("{}", text.as_str())
        }
        Self::needed_by(&header)
    }

    /// What a policy with this header needs.
    #[must_use]
    pub const fn needed_by(header: &Header) -> Self {
        Capacities {
            width: header.width as usize,
            words: header.words as usize,
            programs: header.programs as usize,
            teams: header.teams as usize,
            streams: header.streams as usize,
        }
    }

    /// Ends the compilation unless an agent of these capacities fits into `available`.
    ///
    /// # Panics
    /// If it does not, naming what is needed and what is available.
    #[expect(
        clippy::panic,
        reason = "for constant expressions, where it ends the compilation"
    )]
    pub const fn assert_fits(&self, available: &Self) {
        if let Some((resource, needed, available)) = self.excess_over(available) {
            let text = Text::new()
                .text("policy needs ")
                .text(resource.name())
                .text(" = ")
                .number(needed as u64)
                .text(", available are ")
                .number(available as u64);
            panic!("{}", text.as_str())
        }
    }

    /// Checks that an agent of these capacities fits into `available`.
    pub(crate) const fn check(&self, available: &Self) -> Result<(), CapacityError> {
        match self.excess_over(available) {
            None => Ok(()),
            Some((resource, needed, available)) => Err(CapacityError {
                resource,
                needed,
                available,
            }),
        }
    }

    /// The first resource of which more is needed than there is, or the width if it differs: what, needed, available.
    const fn excess_over(&self, available: &Self) -> Option<(Resource, usize, usize)> {
        if self.width != available.width {
            Some((Resource::Width, self.width, available.width))
        } else if self.words > available.words {
            Some((Resource::Words, self.words, available.words))
        } else if self.programs > available.programs {
            Some((Resource::Programs, self.programs, available.programs))
        } else if self.teams > available.teams {
            Some((Resource::Teams, self.teams, available.teams))
        } else if self.streams > available.streams {
            Some((Resource::Streams, self.streams, available.streams))
        } else {
            None
        }
    }

    /// Bytes of RAM for the state; an agent takes some 200 more.
    #[must_use]
    pub const fn state_bytes(&self) -> usize {
        4 * self.words + 4 * self.programs + self.teams + 16 * self.streams
    }
}

/// The policy does not fit the agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapacityError {
    /// What there is too little of, or the width if it differs.
    pub resource: Resource,
    /// What the policy needs.
    pub needed: usize,
    /// What the agent offers.
    pub available: usize,
}

impl fmt::Display for CapacityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            resource,
            needed,
            available,
        } = self;
        write!(
            f,
            "policy needs {resource} = {needed}, the agent was compiled for {available}"
        )
    }
}

impl core::error::Error for CapacityError {}

/// A short message put together in a constant expression, where nothing else formats numbers.
struct Text {
    bytes: [u8; 160],
    len: usize,
}

impl Text {
    const fn new() -> Self {
        Text {
            bytes: [0; 160],
            len: 0,
        }
    }

    const fn byte(mut self, byte: u8) -> Self {
        if let Some((_, [place, ..])) = self.bytes.split_at_mut_checked(self.len) {
            *place = byte;
            self.len += 1;
        }
        self
    }

    const fn text(mut self, text: &str) -> Self {
        let mut rest = text.as_bytes();
        while let [byte, tail @ ..] = rest {
            self = self.byte(*byte);
            rest = tail;
        }
        self
    }

    const fn number(mut self, number: u64) -> Self {
        if number >= 10 {
            self = self.number(number / 10);
        }
        self.byte(b'0' + (number % 10) as u8)
    }

    const fn as_str(&self) -> &str {
        let (text, _) = self.bytes.split_at(self.len);
        match core::str::from_utf8(text) {
            Ok(text) => text,
            Err(_) => "",
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    const POLICY: &[u8] = include_bytes!("../examples/team-memory.tpg");

    #[test]
    fn capacities_are_those_of_the_header() {
        const NEEDED: Capacities = Capacities::of(POLICY);
        let header = Header::peek(POLICY).expect("a header");
        assert_eq!(NEEDED.words, header.words as usize);
        assert_eq!(NEEDED.width, usize::from(header.width));
        assert_eq!(NEEDED.programs, usize::from(header.programs));
        assert_eq!(NEEDED.teams, usize::from(header.teams));
        assert_eq!(NEEDED.streams, usize::from(header.streams));
    }

    #[test]
    fn the_first_excess_is_named() {
        let needed = Capacities::of(POLICY);
        assert_eq!(needed.excess_over(&needed), None);
        let smaller = Capacities {
            words: needed.words - 1,
            ..needed
        };
        let excess = (Resource::Words, needed.words, needed.words - 1);
        assert_eq!(needed.excess_over(&smaller), Some(excess));
        assert_eq!(smaller.excess_over(&needed), None);
        let wider = Capacities {
            width: needed.width + 1,
            ..needed
        };
        assert!(needed.excess_over(&wider).is_some());
    }

    #[test]
    fn numbers_are_decimal() {
        let text = Text::new().text("n = ").number(0).byte(b' ').number(65_535);
        assert_eq!(text.as_str(), "n = 0 65535");
        let long = (0..20).fold(Text::new(), |text, _| text.number(u64::MAX));
        assert_eq!(long.as_str().len(), 160, "cut off, not out of bounds");
    }
}
