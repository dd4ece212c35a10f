//! Where an agent keeps its state.

use heapless::Vec;

use crate::blob::Header;
use crate::rng::Pcg32;
use crate::sizing::Capacities;

use sealed::Parts;

/// The state of an agent in arrays of constant capacity.
///
/// [`State::new`] works in constant expressions, and all its bytes are zero. A `static` therefore lies in RAM from the start:
/// it takes no flash and never travels over the stack.
///
/// `WORDS`, `PROGRAMS`, `TEAMS` and `STREAMS` are capacities; [`Capacities`](crate::Capacities) says what a policy needs.
/// RAM: 4·`WORDS` + 4·`PROGRAMS` + `TEAMS` + 16·`STREAMS` bytes and some 20 more.
#[derive(Debug, Clone)]
pub struct State<
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
> {
    words: [f32; WORDS],
    bids: Vec<f32, PROGRAMS>,
    visited: Vec<bool, TEAMS>,
    streams: Vec<Pcg32, STREAMS>,
}

impl<const WORDS: usize, const PROGRAMS: usize, const TEAMS: usize, const STREAMS: usize>
    State<WORDS, PROGRAMS, TEAMS, STREAMS>
{
    /// Memory for a state, of no policy yet.
    #[must_use]
    pub const fn new() -> Self {
        State {
            words: [0.0; WORDS],
            bids: Vec::new(),
            visited: Vec::new(),
            streams: Vec::new(),
        }
    }
}

impl<const WORDS: usize, const PROGRAMS: usize, const TEAMS: usize, const STREAMS: usize> Default
    for State<WORDS, PROGRAMS, TEAMS, STREAMS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Memory of its caller for the state of an agent, for sizes that are known only when a policy arrives.
///
/// [`Capacities`](crate::Capacities) says how much of each a policy needs. More is not used.
#[derive(Debug)]
pub struct Slices<'s> {
    /// Registers, shared memory, observation and outputs.
    pub words: &'s mut [f32],
    /// One for each program.
    pub bids: &'s mut [f32],
    /// One for each team.
    pub visited: &'s mut [bool],
    /// Random streams of team memory.
    pub streams: &'s mut [Pcg32],
}

/// Memory in which an agent keeps its state: a [`State`], [`Slices`], or an exclusive reference to one of them.
pub trait Storage: sealed::Storage {}

impl<const WORDS: usize, const PROGRAMS: usize, const TEAMS: usize, const STREAMS: usize> Storage
    for State<WORDS, PROGRAMS, TEAMS, STREAMS>
{
}
impl Storage for Slices<'_> {}
impl<S: Storage> Storage for &mut S {}

pub(crate) mod sealed {
    use core::borrow::BorrowMut;

    use super::{Capacities, Header, Pcg32};

    /// The parts of a state. The interpreter is compiled for the type of the words.
    pub struct Parts<'s, W: ?Sized> {
        pub words: &'s mut W,
        pub bids: &'s mut [f32],
        pub visited: &'s mut [bool],
        pub streams: &'s mut [Pcg32],
    }

    pub trait Storage {
        type Words: BorrowMut<[f32]> + ?Sized;

        /// What there is room for. The width is not the storage's matter and is 0.
        fn room(&self) -> Capacities;
        /// Prepares for a policy that there is room for.
        fn fit(&mut self, needed: &Capacities);
        fn words(&self) -> &[f32];
        /// The parts of the state of a policy with this header, which was prepared for. There may be more words than it needs.
        fn parts(&mut self, header: &Header) -> Parts<'_, Self::Words>;
    }
}

impl<const WORDS: usize, const PROGRAMS: usize, const TEAMS: usize, const STREAMS: usize>
    sealed::Storage for State<WORDS, PROGRAMS, TEAMS, STREAMS>
{
    type Words = [f32; WORDS];

    fn room(&self) -> Capacities {
        Capacities {
            width: 0,
            words: WORDS,
            programs: PROGRAMS,
            teams: TEAMS,
            streams: STREAMS,
        }
    }

    fn fit(&mut self, needed: &Capacities) {
        // None of these can fail: the lengths were just compared with the capacities.
        let _ = self.bids.resize(needed.programs, f32::NAN);
        let _ = self.visited.resize(needed.teams, false);
        let _ = self.streams.resize(needed.streams, Pcg32::new(0, 0));
    }

    fn words(&self) -> &[f32] {
        &self.words
    }

    #[inline(always)]
    fn parts(&mut self, _: &Header) -> Parts<'_, [f32; WORDS]> {
        Parts {
            words: &mut self.words,
            bids: self.bids.as_mut_slice(),
            visited: self.visited.as_mut_slice(),
            streams: self.streams.as_mut_slice(),
        }
    }
}

impl sealed::Storage for Slices<'_> {
    type Words = [f32];

    fn room(&self) -> Capacities {
        Capacities {
            width: 0,
            words: self.words.len(),
            programs: self.bids.len(),
            teams: self.visited.len(),
            streams: self.streams.len(),
        }
    }

    fn fit(&mut self, _: &Capacities) {}

    fn words(&self) -> &[f32] {
        self.words
    }

    #[inline(always)]
    fn parts(&mut self, header: &Header) -> Parts<'_, [f32]> {
        Parts {
            words: first(self.words, header.words as usize),
            bids: first(self.bids, usize::from(header.programs)),
            visited: first(self.visited, usize::from(header.teams)),
            streams: first(self.streams, usize::from(header.streams)),
        }
    }
}

/// The first elements of a slice that has as many.
#[inline(always)]
fn first<T>(slice: &mut [T], len: usize) -> &mut [T] {
    slice.get_mut(..len).unwrap_or_default()
}

impl<S: Storage> sealed::Storage for &mut S {
    type Words = S::Words;

    fn room(&self) -> Capacities {
        (**self).room()
    }

    fn fit(&mut self, needed: &Capacities) {
        (**self).fit(needed);
    }

    fn words(&self) -> &[f32] {
        (**self).words()
    }

    #[inline(always)]
    fn parts(&mut self, header: &Header) -> Parts<'_, S::Words> {
        (**self).parts(header)
    }
}
