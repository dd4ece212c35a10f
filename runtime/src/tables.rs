//! Records of the blob's tables and the borrowed view of them.
//!
//! Every record has a fixed width, is little-endian and is read in place, at any alignment.

pub use crate::isa::Section;
use crate::isa::{Op, REGISTERS, SLOTS};

/// Number of a team in its policy; the root team is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TeamId(pub u16);

/// Number of a program in its policy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ProgramId(pub u16);

/// Where a program leads if it wins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// To an action, which ends the decision.
    ///
    /// In a discrete task the number is the index of the action. In a continuous task it is 0. If each output has programs
    /// of its own, it is the number of the output.
    Atomic(u16),
    /// To another team.
    Team(TeamId),
}

impl Target {
    const ATOMIC: u16 = 0x8000;
    /// Largest team or action number that a target can name.
    pub const MAX: u16 = Self::ATOMIC - 1;

    const fn decode(word: u16) -> Self {
        if word & Self::ATOMIC != 0 {
            Target::Atomic(word & Self::MAX)
        } else {
            Target::Team(TeamId(word))
        }
    }

    const fn encode(self) -> u16 {
        match self {
            Target::Atomic(action) => Self::ATOMIC | (action & Self::MAX),
            Target::Team(TeamId(team)) => team & Self::MAX,
        }
    }
}

/// A team: its members, in order, and its shared memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Team {
    /// First entry in the members table.
    pub members_start: u32,
    /// Number of members.
    pub members_len: u16,
    /// For each section a bit for each slot. The bit is set if a member reads the slot. Other slots are not kept.
    pub slots: [u8; 3],
    /// Selects the team's random streams. Clones of a team have the same key.
    pub stream_key: u32,
    /// First entry of the memory's start values in the constants table.
    pub constants_start: u32,
    /// First state word of the team's memory: kept scalar slots, then vectors, then matrices.
    pub memory_start: u16,
    /// First of the team's random streams. Each section that keeps a slot has one.
    pub streams_start: u16,
}

impl Team {
    /// Bytes of one record.
    pub const BYTES: usize = 24;

    /// The record as stored.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let [a0, a1, a2, a3] = self.members_start.to_le_bytes();
        let [b0, b1] = self.members_len.to_le_bytes();
        let [s0, s1, s2] = self.slots;
        let [k0, k1, k2, k3] = self.stream_key.to_le_bytes();
        let [c0, c1, c2, c3] = self.constants_start.to_le_bytes();
        let [m0, m1] = self.memory_start.to_le_bytes();
        let [r0, r1] = self.streams_start.to_le_bytes();
        [
            a0, a1, a2, a3, b0, b1, s0, s1, s2, 0, k0, k1, k2, k3, c0, c1, c2, c3, m0, m1, r0, r1,
            0, 0,
        ]
    }

    /// Reads a stored record.
    #[inline(always)]
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let [.., s0, s1, s2, _] = *chunk::<10>(bytes, 0);
        Team {
            members_start: u32::from_le_bytes(*chunk(bytes, 0)),
            members_len: u16::from_le_bytes(*chunk(bytes, 4)),
            slots: [s0, s1, s2],
            stream_key: u32::from_le_bytes(*chunk(bytes, 10)),
            constants_start: u32::from_le_bytes(*chunk(bytes, 14)),
            memory_start: u16::from_le_bytes(*chunk(bytes, 18)),
            streams_start: u16::from_le_bytes(*chunk(bytes, 20)),
        }
    }

    /// The slots that `section` keeps, one bit each.
    #[inline(always)]
    #[must_use]
    pub const fn kept(&self, section: Section) -> u8 {
        let [scalar, vector, matrix] = self.slots;
        match section {
            Section::Scalar => scalar,
            Section::Vector => vector,
            Section::Matrix => matrix,
        }
    }

    /// Number of state words of the team's memory at vector width `width`.
    #[must_use]
    pub fn memory_words(&self, width: usize) -> usize {
        Section::ALL
            .iter()
            .map(|s| self.kept(*s).count_ones() as usize * s.slot_words(width))
            .sum()
    }

    /// Number of random streams that the team owns.
    #[must_use]
    pub fn streams(&self) -> usize {
        self.slots.iter().filter(|kept| **kept != 0).count()
    }

    /// First state word of a slot, `None` if the slot is not kept.
    #[cfg_attr(feature = "small-code", inline(never))]
    #[cfg_attr(not(feature = "small-code"), inline)]
    #[must_use]
    pub fn slot_start(&self, section: Section, slot: usize, width: usize) -> Option<usize> {
        let kept = self.kept(section);
        if slot >= SLOTS || kept & (1 << slot) == 0 {
            return None;
        }
        let before = kept & ((1u8 << slot) - 1);
        let sections_before: usize = Section::ALL
            .iter()
            .take(section as usize)
            .map(|s| self.kept(*s).count_ones() as usize * s.slot_words(width))
            .sum();
        Some(
            usize::from(self.memory_start)
                + sections_before
                + before.count_ones() as usize * section.slot_words(width),
        )
    }

    /// Number of the random stream of a section, `None` if the section keeps no slot.
    #[inline]
    #[must_use]
    pub fn stream(&self, section: Section) -> Option<usize> {
        if self.kept(section) == 0 {
            return None;
        }
        let before = self.slots.iter().take(section as usize);
        Some(usize::from(self.streams_start) + before.filter(|kept| **kept != 0).count())
    }
}

/// A program: its code, registers and action.
///
/// Its registers lie in the state from `state_start` on: scalars (the bid first), then vectors, then matrices.
/// Its evolved constants lie in the same order from `constants_start` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Program {
    /// First instruction.
    pub code_start: u32,
    /// Number of instructions.
    pub code_len: u16,
    /// Where the program leads if it wins.
    pub target: Target,
    /// First entry of its evolved constants in the constants table.
    pub constants_start: u32,
    /// First state word of its registers.
    pub state_start: u16,
    /// First state word of its continuous action, `state_start` if it has none.
    pub output: u16,
    /// Number of scalar, vector and matrix registers, at most [`REGISTERS`] each.
    pub registers: [u8; 3],
}

impl Default for Program {
    /// A program without code and registers that gives action 0.
    fn default() -> Self {
        Program {
            code_start: 0,
            code_len: 0,
            target: Target::Atomic(0),
            constants_start: 0,
            state_start: 0,
            output: 0,
            registers: [0; 3],
        }
    }
}

impl Program {
    /// Bytes of one record.
    pub const BYTES: usize = 20;

    /// The record as stored.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let [a0, a1, a2, a3] = self.code_start.to_le_bytes();
        let [b0, b1] = self.code_len.to_le_bytes();
        let [t0, t1] = self.target.encode().to_le_bytes();
        let [c0, c1, c2, c3] = self.constants_start.to_le_bytes();
        let [s0, s1] = self.state_start.to_le_bytes();
        let [o0, o1] = self.output.to_le_bytes();
        let [n0, n1, n2] = self.registers;
        [
            a0, a1, a2, a3, b0, b1, t0, t1, c0, c1, c2, c3, s0, s1, o0, o1, n0, n1, n2, 0,
        ]
    }

    /// Reads a stored record.
    #[inline(always)]
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Program {
            code_start: u32::from_le_bytes(*chunk(bytes, 0)),
            code_len: u16::from_le_bytes(*chunk(bytes, 4)),
            target: Target::decode(u16::from_le_bytes(*chunk(bytes, 6))),
            constants_start: u32::from_le_bytes(*chunk(bytes, 8)),
            state_start: u16::from_le_bytes(*chunk(bytes, 12)),
            output: u16::from_le_bytes(*chunk(bytes, 14)),
            registers: *chunk(bytes, 16),
        }
    }

    /// Number of state words of its registers at vector width `width`.
    #[inline(always)]
    #[must_use]
    pub fn register_words(&self, width: usize) -> usize {
        let [s, v, m] = self.registers.map(usize::from);
        s + v * width + m * width * width
    }

    /// Whether the program has at most [`REGISTERS`] registers of each kind.
    #[must_use]
    pub fn registers_in_range(&self) -> bool {
        self.registers.iter().all(|n| usize::from(*n) <= REGISTERS)
    }
}

/// An instruction: an operation and three fields.
///
/// A field is a state offset or the number of a slot, of an element or of a cell. [`Op`] says which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// State offset of the destination, 0 if there is none.
    pub d: u16,
    /// First operand.
    pub a: u16,
    /// Second operand.
    pub b: u16,
}

impl Instruction {
    /// Bytes of one record.
    pub const BYTES: usize = 8;

    /// The record as stored.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let [d0, d1] = self.d.to_le_bytes();
        let [a0, a1] = self.a.to_le_bytes();
        let [b0, b1] = self.b.to_le_bytes();
        [self.op as u8, 0, d0, d1, a0, a1, b0, b1]
    }

    /// Reads a stored record. Returns `None` if no operation has its code.
    #[inline(always)]
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        match Self::parts(bytes) {
            (Some(op), [d, a, b]) => Some(Instruction { op, d, a, b }),
            (None, _) => None,
        }
    }

    /// The operation of a stored record and its fields `d`, `a` and `b`. The operation is `None` if its code is unknown.
    #[inline(always)]
    pub(crate) const fn parts(bytes: &[u8; Self::BYTES]) -> (Option<Op>, [u16; 3]) {
        // Reading the fields byte by byte would cost more than most operations do.
        let (&[[code, _], d, a, b], []) = bytes.as_chunks::<2>() else {
            return (None, [0; 3]);
        };
        let fields = [
            u16::from_le_bytes(d),
            u16::from_le_bytes(a),
            u16::from_le_bytes(b),
        ];
        (Op::from_code(code), fields)
    }
}

/// The range of an input or of an output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lowest value. Of an input without a range: −∞.
    pub low: f32,
    /// Highest value. Of an input without a range: +∞.
    pub high: f32,
}

impl Range {
    /// Bytes of one record.
    pub const BYTES: usize = 8;
    /// The range of an input that has none.
    pub const ALL: Self = Range {
        low: f32::NEG_INFINITY,
        high: f32::INFINITY,
    };

    /// The record as stored.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let [l0, l1, l2, l3] = self.low.to_le_bytes();
        let [h0, h1, h2, h3] = self.high.to_le_bytes();
        [l0, l1, l2, l3, h0, h1, h2, h3]
    }

    /// Reads a stored record.
    #[inline(always)]
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let [l0, l1, l2, l3, h0, h1, h2, h3] = *bytes;
        Range {
            low: f32::from_le_bytes([l0, l1, l2, l3]),
            high: f32::from_le_bytes([h0, h1, h2, h3]),
        }
    }
}

/// A team as stored.
pub(crate) type TeamRecord = [u8; Team::BYTES];
/// A program as stored.
pub(crate) type ProgramRecord = [u8; Program::BYTES];
/// Instructions as stored.
pub(crate) type Code<'c> = &'c [[u8; Instruction::BYTES]];

/// The tables of a blob, borrowed from its bytes.
#[derive(Debug, Clone, Copy, Default)]
#[non_exhaustive]
pub struct Tables<'a> {
    /// Teams. The first one is the root.
    pub teams: &'a [[u8; Team::BYTES]],
    /// Program numbers of the teams' members, little-endian.
    pub members: &'a [[u8; 2]],
    /// Programs.
    pub programs: &'a [[u8; Program::BYTES]],
    /// Instructions of all programs.
    pub code: &'a [[u8; Instruction::BYTES]],
    /// Evolved constants of programs and teams, little-endian `f32`.
    pub constants: &'a [[u8; 4]],
    /// Numbers of the kept cells of indexed memory (row · 8 + column), ascending, little-endian.
    pub cells: &'a [[u8; 2]],
    /// Team memory and cells as they were after the policy was scored, little-endian `f32`. Empty if the file has none.
    pub memory: &'a [[u8; 4]],
    /// The front end's coefficients. Empty if the policy has no front end.
    pub front_end: &'a [u8],
    /// One line `name<TAB>unit` for each input, then one for each output.
    pub labels: &'a str,
    /// The task that the policy was evolved for, with its version.
    pub task: &'a str,
    /// The observability wrappers of that task, joined by `+`.
    pub observability: &'a str,
    /// Ranges of the inputs, then of the continuous outputs. Empty if inputs have none and all outputs that of the header.
    pub ranges: &'a [[u8; Range::BYTES]],
}

impl<'a> Tables<'a> {
    /// The record of a team, `None` if there is no such team.
    #[inline(always)]
    #[must_use]
    pub fn team(&self, team_id: TeamId) -> Option<Team> {
        self.teams.get(usize::from(team_id.0)).map(Team::from_bytes)
    }

    /// The record of a program, `None` if there is no such program.
    #[inline(always)]
    #[must_use]
    pub fn program(&self, program_id: ProgramId) -> Option<Program> {
        self.programs
            .get(usize::from(program_id.0))
            .map(Program::from_bytes)
    }

    /// The team's programs, in order. Empty if the record reaches past the table.
    #[inline(always)]
    pub fn members(&self, team: &Team) -> impl Iterator<Item = ProgramId> + 'a {
        span(self.members, team.members_start, team.members_len)
            .unwrap_or_default()
            .iter()
            .map(|bytes| ProgramId(u16::from_le_bytes(*bytes)))
    }

    /// The program's instructions as stored. Empty if the record reaches past the table.
    #[inline(always)]
    #[must_use]
    pub fn code(&self, program: &Program) -> &'a [[u8; Instruction::BYTES]] {
        span(self.code, program.code_start, program.code_len).unwrap_or_default()
    }
}

/// `N` bytes of a record from `at`; zeros if it has fewer.
///
/// A record that is taken apart byte by byte is also loaded so, which costs more than most operations do.
#[inline(always)]
const fn chunk<const N: usize>(record: &[u8], at: usize) -> &[u8; N] {
    if let Some((_, rest)) = record.split_at_checked(at)
        && let Some(chunk) = rest.first_chunk()
    {
        return chunk;
    }
    &[0; N]
}

/// `len` entries of a table from `start`, `None` if the table is shorter.
#[inline(always)]
pub(crate) fn span<T>(table: &[T], start: u32, len: u16) -> Option<&[T]> {
    let start = usize::try_from(start).ok()?;
    table.get(start..)?.get(..usize::from(len))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_survive_their_bytes() {
        let team = Team {
            members_start: 0x0102_0304,
            members_len: 0x0506,
            slots: [7, 8, 9],
            stream_key: 0x0a0b_0c0d,
            constants_start: 0x1112_1314,
            memory_start: 0x1516,
            streams_start: 0x1718,
        };
        assert_eq!(Team::from_bytes(&team.to_bytes()), team);
        for target in [Target::Atomic(3), Target::Team(TeamId(0x7fff))] {
            let program = Program {
                code_start: 0x0102_0304,
                code_len: 0x0506,
                target,
                constants_start: 0x0708_090a,
                state_start: 0x0b0c,
                output: 0x0d0e,
                registers: [1, 2, 3],
            };
            assert_eq!(Program::from_bytes(&program.to_bytes()), program);
        }
        for op in Op::ALL {
            let instruction = Instruction {
                op: *op,
                d: 0x0102,
                a: 0x0304,
                b: 0x0506,
            };
            assert_eq!(
                Instruction::from_bytes(&instruction.to_bytes()),
                Some(instruction)
            );
        }
    }

    #[test]
    fn slots_are_packed_section_after_section() {
        let team = Team {
            slots: [0b1000_0001, 0, 0b0000_0110],
            memory_start: 100,
            streams_start: 5,
            ..Team::default()
        };
        assert_eq!(team.memory_words(3), 2 + 2 * 9);
        assert_eq!(team.slot_start(Section::Scalar, 7, 3), Some(101));
        assert_eq!(team.slot_start(Section::Scalar, 1, 3), None);
        assert_eq!(team.slot_start(Section::Vector, 0, 3), None);
        assert_eq!(team.slot_start(Section::Matrix, 2, 3), Some(111));
        assert_eq!(team.slot_start(Section::Matrix, 8, 3), None);
        assert_eq!(
            Section::ALL.map(|s| team.stream(s)),
            [Some(5), None, Some(6)]
        );
    }
}
