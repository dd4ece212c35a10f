//! The instruction table: the one place that lists operations, their operands, encoding and cost.
//!
//! Names, operand kinds, notation, cost and the fingerprint in every blob derive from the rows of `table!`.
//! What an operation computes stands in [`crate::math`]; `docs/semantics.md` states it in prose.

use crate::hash::{START_32, fnv1a_32};
use crate::parts::Feature;

/// Most registers of each kind in a program (thesis Table 3.2).
pub const REGISTERS: usize = 8;
/// Number of slots in each section of a team's shared memory (thesis §3.4.2).
pub const SLOTS: usize = 8;
/// Number of rows of the classic set's indexed memory (thesis §2.4.3, as in PyTPG).
pub const INDEXED_ROWS: usize = 100;
/// Number of cells of indexed memory. Each of the [`INDEXED_ROWS`] rows has a column for each register.
pub const INDEXED_CELLS: usize = INDEXED_ROWS * REGISTERS;

/// Prints the name of a cell of indexed memory: `cell[row,column]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellName(
    /// Number of the cell, counted row by row, below [`INDEXED_CELLS`].
    pub u16,
);

impl core::fmt::Display for CellName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let columns = REGISTERS as u16;
        write!(f, "cell[{},{}]", self.0 / columns, self.0 % columns)
    }
}

/// A kind of value: scalar, vector or matrix.
///
/// Registers have a kind, and a team's shared memory has a section for each kind (thesis §3.4.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Section {
    /// Registers and slots that hold one scalar.
    Scalar = 0,
    /// Registers and slots that hold a vector of W elements.
    Vector = 1,
    /// Registers and slots that hold a matrix of W × W elements.
    Matrix = 2,
}

impl Section {
    /// The three kinds, in the order of the state words.
    pub const ALL: [Section; 3] = [Section::Scalar, Section::Vector, Section::Matrix];

    /// Number of state words of one register or slot at vector width `width`.
    #[must_use]
    pub const fn slot_words(self, width: usize) -> usize {
        match self {
            Section::Scalar => 1,
            Section::Vector => width,
            Section::Matrix => width * width,
        }
    }
}

/// The kind of register that an instruction writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Destination {
    /// No register of the program.
    None,
    /// A scalar register. Its old value is lost.
    S,
    /// A scalar register. Its old value is an operand too.
    SUpdate,
    /// A vector register. Its old value is lost.
    V,
    /// A vector register. Its old value may stay.
    VUpdate,
    /// A matrix register. Its old value is lost.
    M,
    /// A matrix register. Its old value may stay.
    MUpdate,
}

impl Destination {
    /// The kind of the register. `None` if no register is written.
    #[must_use]
    pub const fn section(self) -> Option<Section> {
        match self {
            Destination::None => None,
            Destination::S | Destination::SUpdate => Some(Section::Scalar),
            Destination::V | Destination::VUpdate => Some(Section::Vector),
            Destination::M | Destination::MUpdate => Some(Section::Matrix),
        }
    }

    /// Whether the register's old value can influence the new one.
    #[must_use]
    pub const fn is_update(self) -> bool {
        matches!(
            self,
            Destination::SUpdate | Destination::VUpdate | Destination::MUpdate
        )
    }
}

/// What an instruction reads through one of its two operand fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// Nothing. The field is stored as zero.
    None,
    /// A scalar register or one element of the observation.
    S,
    /// A vector register or the observation vector.
    V,
    /// A matrix register or the observation matrix.
    M,
    /// One element of a vector register or of the observation vector.
    VElement,
    /// One element of a matrix register or of the observation matrix.
    MElement,
    /// A scalar register, an element of the observation, or an element of a vector.
    SOrVElement,
    /// A slot of the scalar section of team memory.
    ScalarSlot,
    /// A slot of the vector section of team memory.
    VectorSlot,
    /// A slot of the matrix section of team memory.
    MatrixSlot,
    /// Number of an element in the vector of the first operand's slot.
    VectorIndex,
    /// Number of an element, counted row by row, in the matrix of the first operand's slot.
    MatrixIndex,
    /// A cell of indexed memory, counted row by row.
    Cell,
}

impl Operand {
    /// Whether it can be a register or the observation in its place. Its field is then an offset among the state words.
    #[must_use]
    pub const fn is_value(self) -> bool {
        matches!(
            self,
            Operand::S
                | Operand::V
                | Operand::M
                | Operand::VElement
                | Operand::MElement
                | Operand::SOrVElement
        )
    }
}

/// A family of operations. A policy's header lists the families that it uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
#[non_exhaustive]
pub enum Group {
    /// Scalar arithmetic, transcendental functions and the conditional.
    Scalar = 1,
    /// Operations on vectors, and from vectors to scalars.
    Vector = 2,
    /// Operations on matrices, and from matrices to vectors and scalars.
    Matrix = 4,
    /// Copying a register's evolved constants into it. The variant SL-NC has no such operations.
    Constants = 8,
    /// Team shared memory: writes to random slots and reads of one scalar (thesis §3.4.2).
    TeamMemory = 16,
    /// Reads of a whole vector or matrix from team memory (thesis §3.8). Off by default.
    WholeReads = 32,
    /// The ten operations of chapter 2 (thesis §2.5.4), with indexed memory.
    Classic = 64,
    /// Moves, and latches that move only while a scalar is above zero. Off by default; not in the thesis.
    Copies = 128,
}

impl Group {
    /// Every group.
    pub const ALL: [Group; 8] = [
        Group::Scalar,
        Group::Vector,
        Group::Matrix,
        Group::Constants,
        Group::TeamMemory,
        Group::WholeReads,
        Group::Classic,
        Group::Copies,
    ];

    /// The name used in configurations and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Group::Scalar => "scalar",
            Group::Vector => "vector",
            Group::Matrix => "matrix",
            Group::Constants => "constants",
            Group::TeamMemory => "team-memory",
            Group::WholeReads => "whole-reads",
            Group::Classic => "classic",
            Group::Copies => "copies",
        }
    }

    /// The group's bit in a blob's header.
    #[must_use]
    pub const fn bit(self) -> u16 {
        self as u16
    }

    /// The feature of this crate that executes the group.
    #[must_use]
    pub const fn feature(self) -> Feature {
        match self {
            Group::Scalar => Feature::Scalar,
            Group::Vector => Feature::Vector,
            Group::Matrix => Feature::Matrix,
            Group::Constants => Feature::Constants,
            Group::TeamMemory | Group::WholeReads => Feature::TeamMemory,
            Group::Classic => Feature::Classic,
            Group::Copies => Feature::Copies,
        }
    }

    /// Whether this build executes the group.
    #[must_use]
    pub const fn is_built(self) -> bool {
        match self {
            Group::Scalar => cfg!(feature = "scalar"),
            Group::Vector => cfg!(feature = "vector"),
            Group::Matrix => cfg!(feature = "matrix"),
            Group::Constants => cfg!(feature = "constants"),
            Group::TeamMemory | Group::WholeReads => cfg!(feature = "team-memory"),
            Group::Classic => cfg!(feature = "classic"),
            Group::Copies => cfg!(feature = "copies"),
        }
    }
}

/// How often an instruction repeats its unit of work. W is the vector width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Once.
    One,
    /// W times.
    Width,
    /// W² times.
    Square,
    /// W³ times.
    Cube,
    /// Once for each cell of indexed memory that the policy keeps.
    Cells,
}

/// The cost class of an operation, in single-precision operations.
///
/// An addition, a multiplication, a comparison or a move counts 1. A division or a square root counts 4, a random draw 8
/// and a transcendental function 24.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Weighted operations of one repetition.
    pub unit: u8,
    /// Number of repetitions.
    pub extent: Extent,
}

impl Cost {
    /// Weighted operations of one execution at vector width `width`. The policy keeps `cells` cells of indexed memory.
    #[must_use]
    pub const fn weight(self, width: u16, cells: u16) -> u64 {
        let (w, unit) = (width as u64, self.unit as u64);
        unit * match self.extent {
            Extent::One => 1,
            Extent::Width => w,
            Extent::Square => w * w,
            Extent::Cube => w * w * w,
            Extent::Cells => cells as u64,
        }
    }
}

/// How an operation applies its function `f` of [`crate::math`] to its operands `a`, `b` and its destination `d`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Form {
    /// `d = f(a, b)` of scalars, or `d = f(d, a, b)` if the operation reads the old value of `d`.
    Scalar,
    /// Like [`Form::Scalar`], with a function of [`crate::math::classic`].
    Classic,
    /// `f` of each element of the operands.
    Each,
    /// `f` of the scalar `a` and each element of `b`.
    Scale,
    /// Element (r, c) is `f` of element r of `a` and element c of `b`.
    Outer,
    /// A scalar: `f` of all elements of `a`.
    Reduce,
    /// Element r is `f` of row r of `a`.
    Rows,
    /// `f` of whole vectors or matrices.
    Whole,
    /// The scalar `a`, unchanged.
    Move,
    /// The vector or matrix `b` if the scalar `a` is above zero. Otherwise `d` stays.
    Latch,
    /// The scalar `a` in each element.
    Fill,
    /// The vector `a` in each row.
    FillRows,
    /// The vector `a` in each column.
    FillColumns,
    /// The evolved constants of the register `d`.
    Reload,
    /// Writes `a` to a random slot of the team's memory.
    Write,
    /// Reads one scalar from a slot of the team's memory.
    Read,
    /// Reads all values of a slot of the team's memory.
    ReadWhole,
    /// Writes the scalar registers to random cells of indexed memory.
    WriteCells,
}

/// The instruction table: calls the macro `$then` with all rows.
///
/// A row has these parts, in this order:
/// - code, name, mnemonic, [`Group`];
/// - [`Destination`] and two [`Operand`]s;
/// - unit and [`Extent`] of the [`Cost`];
/// - notation;
/// - [`Form`], and the function of [`crate::math`] if the form needs one.
macro_rules! table {
    ($then:ident) => {
        $then! {
            // code name mnemonic group: destination <- operands; unit and extent of the cost; notation; form and function
            0 Add "add" Scalar: S <- S, S; 1 One; "{d} = {a} + {b}"; Scalar add
            1 Sub "sub" Scalar: S <- S, S; 1 One; "{d} = {a} - {b}"; Scalar sub
            2 Mul "mul" Scalar: S <- S, S; 1 One; "{d} = {a} * {b}"; Scalar mul
            3 Div "div" Scalar: S <- S, S; 4 One; "{d} = {a} / {b}"; Scalar div
            4 Min "min" Scalar: S <- S, S; 1 One; "{d} = min({a}, {b})"; Scalar min
            5 Max "max" Scalar: S <- S, S; 1 One; "{d} = max({a}, {b})"; Scalar max
            6 Pow "pow" Scalar: S <- S, S; 24 One; "{d} = pow({a}, {b})"; Scalar pow
            7 Abs "abs" Scalar: S <- S, None; 1 One; "{d} = abs({a})"; Scalar abs
            8 Recip "recip" Scalar: S <- S, None; 4 One; "{d} = 1 / {a}"; Scalar recip
            9 Sqr "sqr" Scalar: S <- S, None; 1 One; "{d} = {a}^2"; Scalar sqr
            10 Cube "cube" Scalar: S <- S, None; 2 One; "{d} = {a}^3"; Scalar cube
            11 Sqrt "sqrt" Scalar: S <- S, None; 4 One; "{d} = sqrt({a})"; Scalar sqrt
            12 Sin "sin" Scalar: S <- S, None; 24 One; "{d} = sin({a})"; Scalar sin
            13 Cos "cos" Scalar: S <- S, None; 24 One; "{d} = cos({a})"; Scalar cos
            14 Tan "tan" Scalar: S <- S, None; 24 One; "{d} = tan({a})"; Scalar tan
            15 Asin "asin" Scalar: S <- S, None; 24 One; "{d} = asin({a})"; Scalar asin
            16 Acos "acos" Scalar: S <- S, None; 24 One; "{d} = acos({a})"; Scalar acos
            17 Atan "atan" Scalar: S <- S, None; 24 One; "{d} = atan({a})"; Scalar atan
            18 Tanh "tanh" Scalar: S <- S, None; 24 One; "{d} = tanh({a})"; Scalar tanh
            19 Exp "exp" Scalar: S <- S, None; 24 One; "{d} = exp({a})"; Scalar exp
            20 Log "log" Scalar: S <- S, None; 24 One; "{d} = log({a})"; Scalar log
            21 Heaviside "heaviside" Scalar: S <- S, None; 1 One; "{d} = heaviside({a})"; Scalar heaviside
            22 Cond "cond" Scalar: SUpdate <- SOrVElement, S; 1 One; "if {d} < {a}: {d} = -{b}"; Scalar cond

            23 VAdd "v-add" Vector: V <- V, V; 1 Width; "{d} = {a} + {b}"; Each add
            24 VSub "v-sub" Vector: V <- V, V; 1 Width; "{d} = {a} - {b}"; Each sub
            25 VMul "v-mul" Vector: V <- V, V; 1 Width; "{d} = {a} .* {b}"; Each mul
            26 VDiv "v-div" Vector: V <- V, V; 4 Width; "{d} = {a} ./ {b}"; Each div
            27 VMin "v-min" Vector: V <- V, V; 1 Width; "{d} = min({a}, {b})"; Each min
            28 VMax "v-max" Vector: V <- V, V; 1 Width; "{d} = max({a}, {b})"; Each max
            29 VAbs "v-abs" Vector: V <- V, None; 1 Width; "{d} = abs({a})"; Each abs
            30 VRecip "v-recip" Vector: V <- V, None; 4 Width; "{d} = 1 ./ {a}"; Each recip
            31 VHeaviside "v-heaviside" Vector: V <- V, None; 1 Width; "{d} = heaviside({a})"; Each heaviside
            32 VScale "v-scale" Vector: V <- S, V; 1 Width; "{d} = {a} * {b}"; Scale mul
            33 VBroadcast "v-broadcast" Vector: V <- S, None; 1 Width; "{d} = broadcast({a})"; Fill
            34 Dot "dot" Vector: S <- V, V; 2 Width; "{d} = dot({a}, {b})"; Whole dot
            35 VNorm "v-norm" Vector: S <- V, None; 3 Width; "{d} = norm({a})"; Reduce norm
            36 VMean "v-mean" Vector: S <- V, None; 2 Width; "{d} = mean({a})"; Reduce mean
            37 VStd "v-std" Vector: S <- V, None; 4 Width; "{d} = std({a})"; Reduce std
            38 VElement "v-element" Vector: S <- VElement, None; 1 One; "{d} = {a}"; Move

            39 MatVec "mat-vec" Matrix: V <- M, V; 2 Square; "{d} = {a} x {b}"; Whole mat_vec
            40 RowNorm "row-norm" Matrix: V <- M, None; 3 Square; "{d} = row_norm({a})"; Rows norm
            41 ColumnNorm "column-norm" Matrix: V <- M, None; 3 Square; "{d} = column_norm({a})"; Whole column_norm
            42 RowMean "row-mean" Matrix: V <- M, None; 2 Square; "{d} = row_mean({a})"; Rows mean
            43 RowStd "row-std" Matrix: V <- M, None; 4 Square; "{d} = row_std({a})"; Rows std
            44 MAdd "m-add" Matrix: M <- M, M; 1 Square; "{d} = {a} + {b}"; Each add
            45 MSub "m-sub" Matrix: M <- M, M; 1 Square; "{d} = {a} - {b}"; Each sub
            46 MMul "m-mul" Matrix: M <- M, M; 1 Square; "{d} = {a} .* {b}"; Each mul
            47 MDiv "m-div" Matrix: M <- M, M; 4 Square; "{d} = {a} ./ {b}"; Each div
            48 MMin "m-min" Matrix: M <- M, M; 1 Square; "{d} = min({a}, {b})"; Each min
            49 MMax "m-max" Matrix: M <- M, M; 1 Square; "{d} = max({a}, {b})"; Each max
            50 MAbs "m-abs" Matrix: M <- M, None; 1 Square; "{d} = abs({a})"; Each abs
            51 MRecip "m-recip" Matrix: M <- M, None; 4 Square; "{d} = 1 ./ {a}"; Each recip
            52 MHeaviside "m-heaviside" Matrix: M <- M, None; 1 Square; "{d} = heaviside({a})"; Each heaviside
            53 Transpose "transpose" Matrix: M <- M, None; 1 Square; "{d} = transpose({a})"; Whole transpose
            54 MScale "m-scale" Matrix: M <- S, M; 1 Square; "{d} = {a} * {b}"; Scale mul
            55 Outer "outer" Matrix: M <- V, V; 1 Square; "{d} = outer({a}, {b})"; Outer mul
            56 MatMul "mat-mul" Matrix: M <- M, M; 2 Cube; "{d} = {a} x {b}"; Whole mat_mul
            57 BroadcastRows "broadcast-rows" Matrix: M <- V, None; 1 Square; "{d} = rows({a})"; FillRows
            58 BroadcastColumns "broadcast-columns" Matrix: M <- V, None; 1 Square; "{d} = columns({a})"; FillColumns
            59 MNorm "m-norm" Matrix: S <- M, None; 2 Square; "{d} = norm({a})"; Reduce norm
            60 MMean "m-mean" Matrix: S <- M, None; 1 Square; "{d} = mean({a})"; Reduce mean
            61 MStd "m-std" Matrix: S <- M, None; 4 Square; "{d} = std({a})"; Reduce std
            62 MElement "m-element" Matrix: S <- MElement, None; 1 One; "{d} = {a}"; Move

            63 ReloadS "reload-s" Constants: S <- None, None; 1 One; "{d} = constant"; Reload
            64 ReloadV "reload-v" Constants: V <- None, None; 1 Width; "{d} = constant"; Reload
            65 ReloadM "reload-m" Constants: M <- None, None; 1 Square; "{d} = constant"; Reload

            66 WriteS "write-s" TeamMemory: None <- S, None; 9 One; "scalar_memory_write({a})"; Write
            67 WriteV "write-v" TeamMemory: None <- V, None; 9 Width; "vector_memory_write({a})"; Write
            68 WriteM "write-m" TeamMemory: None <- M, None; 9 Square; "matrix_memory_write({a})"; Write
            69 ReadS "read-s" TeamMemory: S <- ScalarSlot, None; 1 One; "{d} = {a}"; Read
            70 ReadV "read-v" TeamMemory: S <- VectorSlot, VectorIndex; 1 One; "{d} = {a}[{b}]"; Read
            71 ReadM "read-m" TeamMemory: S <- MatrixSlot, MatrixIndex; 1 One; "{d} = {a}[{b}]"; Read
            72 ReadWholeV "read-whole-v" WholeReads: V <- VectorSlot, None; 1 Width; "{d} = {a}"; ReadWhole
            73 ReadWholeM "read-whole-m" WholeReads: M <- MatrixSlot, None; 1 Square; "{d} = {a}"; ReadWhole

            74 ClassicAdd "classic-add" Classic: SUpdate <- S, None; 1 One; "{d} = {d} + {a}"; Classic add
            75 ClassicSub "classic-sub" Classic: SUpdate <- S, None; 1 One; "{d} = {d} - {a}"; Classic sub
            76 ClassicMult "classic-mult" Classic: SUpdate <- None, None; 1 One; "{d} = {d} * 2"; Classic mult
            77 ClassicDiv "classic-div" Classic: SUpdate <- None, None; 1 One; "{d} = {d} / 2"; Classic div
            78 ClassicNeg "classic-neg" Classic: SUpdate <- S, None; 1 One; "if {d} < {a}: {d} = -{d}"; Classic neg
            79 ClassicCos "classic-cos" Classic: S <- S, None; 24 One; "{d} = cos({a})"; Classic cos
            80 ClassicLog "classic-log" Classic: SUpdate <- S, None; 24 One; "if {a} > 0: {d} = log({a})"; Classic log
            81 ClassicExp "classic-exp" Classic: S <- S, None; 24 One; "{d} = exp({a})"; Classic exp
            82 MemRead "mem-read" Classic: S <- Cell, None; 1 One; "{d} = {a}"; Move
            83 MemWrite "mem-write" Classic: None <- None, None; 8 Cells; "memory_write(s0..s7)"; WriteCells

            84 Move "move" Copies: S <- S, None; 1 One; "{d} = {a}"; Move
            85 Latch "latch" Copies: SUpdate <- S, S; 1 One; "if {a} > 0: {d} = {b}"; Scalar latch
            86 VMove "v-move" Copies: V <- V, None; 1 Width; "{d} = {a}"; Each same
            87 VLatch "v-latch" Copies: VUpdate <- S, V; 1 Width; "if {a} > 0: {d} = {b}"; Latch
            88 MMove "m-move" Copies: M <- M, None; 1 Square; "{d} = {a}"; Each same
            89 MLatch "m-latch" Copies: MUpdate <- S, M; 1 Square; "if {a} > 0: {d} = {b}"; Latch
        }
    };
}
pub(crate) use table;

macro_rules! define {
    ($($code:literal $name:ident $mnemonic:literal $group:ident: $dst:ident <- $a:ident, $b:ident; $unit:literal $extent:ident; $notation:literal; $form:ident $($function:ident)?)*) => {
        /// An operation.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum Op {
            $(#[doc = concat!("`", $notation, "`")] $name = $code,)*
        }

        impl Op {
            /// All operations, in the order of their codes.
            pub const ALL: &'static [Op] = &[$(Op::$name),*];

            /// The operation with this code, `None` if there is none.
            #[inline(always)]
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Op> {
                match code {
                    $($code => Some(Op::$name),)*
                    _ => None,
                }
            }

            /// Short unique name, used in configurations and disassembly.
            #[must_use]
            pub const fn mnemonic(self) -> &'static str {
                match self { $(Op::$name => $mnemonic,)* }
            }

            /// Readable form. `{d}`, `{a}` and `{b}` stand for destination and operands.
            #[must_use]
            pub const fn notation(self) -> &'static str {
                match self { $(Op::$name => $notation,)* }
            }

            /// The family that the operation belongs to.
            #[must_use]
            pub const fn group(self) -> Group {
                match self { $(Op::$name => Group::$group,)* }
            }

            /// What the operation writes.
            #[must_use]
            pub const fn destination(self) -> Destination {
                match self { $(Op::$name => Destination::$dst,)* }
            }

            /// What the operation reads through its fields `a` and `b`.
            #[must_use]
            pub const fn operands(self) -> [Operand; 2] {
                match self { $(Op::$name => [Operand::$a, Operand::$b],)* }
            }

            /// The cost of one execution.
            #[must_use]
            pub const fn cost(self) -> Cost {
                match self { $(Op::$name => Cost { unit: $unit, extent: Extent::$extent },)* }
            }

            /// How the operation applies its function of [`crate::math`]. Code generators use it.
            #[must_use]
            pub const fn form(self) -> Form {
                match self { $(Op::$name => Form::$form,)* }
            }

            /// Name of that function. It is empty if the form needs none.
            #[must_use]
            pub const fn function(self) -> &'static str {
                match self { $(Op::$name => concat!($(stringify!($function))?),)* }
            }
        }

        /// For each operation, what of its row enters the fingerprint: code, mnemonic, destination kind and operand kinds.
        const ROWS: &[&str] = &[$(concat!(
            stringify!($code), $mnemonic, stringify!($dst), stringify!($a), stringify!($b), ";",
        )),*];
    };
}

table!(define);

/// A released table of operations. A later edition begins with all rows of the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Edition {
    /// Number of operations. Their codes are below it.
    pub operations: u8,
    /// Names the edition in every blob: FNV-1a hash of the rows. Group, cost, notation and form do not enter it.
    pub fingerprint: u32,
}

impl Edition {
    const fn new(operations: u8) -> Self {
        let (mut hash, mut rows) = (START_32, ROWS);
        while rows.len() > ROWS.len() - operations as usize
            && let [row, tail @ ..] = rows
        {
            hash = fnv1a_32(hash, row.as_bytes());
            rows = tail;
        }
        Edition {
            operations,
            fingerprint: hash,
        }
    }

    /// The oldest edition that has all operations of the groups, given by their bits.
    #[must_use]
    pub const fn of_groups(groups: u16) -> Self {
        let [first, second] = EDITIONS;
        if groups & Group::Copies.bit() == 0 {
            first
        } else {
            second
        }
    }

    /// The groups of the edition's operations, as bits.
    #[must_use]
    pub const fn groups(self) -> u16 {
        let (mut groups, mut rest) = (0, Op::ALL);
        while let [op, tail @ ..] = rest {
            if (*op as u8) < self.operations {
                groups |= op.group().bit();
            }
            rest = tail;
        }
        groups
    }

    /// The edition with this fingerprint, `None` if this build knows none.
    #[must_use]
    pub const fn find(fingerprint: u32) -> Option<Self> {
        let mut rest = EDITIONS.as_slice();
        while let [edition, tail @ ..] = rest {
            if edition.fingerprint == fingerprint {
                return Some(*edition);
            }
            rest = tail;
        }
        None
    }
}

/// Every edition that this build reads, oldest first.
pub const EDITIONS: [Edition; 2] = [Edition::new(84), Edition::new(90)];

/// The fingerprint of the newest edition: this build's whole table.
pub const FINGERPRINT: u32 = EDITIONS[1].fingerprint;

impl Op {
    /// The section of team memory that the operation writes or reads, `None` if it does neither.
    #[must_use]
    pub const fn section(self) -> Option<Section> {
        let [first, _] = self.operands();
        match (self.group(), first) {
            (Group::TeamMemory, Operand::S) | (_, Operand::ScalarSlot) => Some(Section::Scalar),
            (Group::TeamMemory, Operand::V) | (_, Operand::VectorSlot) => Some(Section::Vector),
            (Group::TeamMemory, Operand::M) | (_, Operand::MatrixSlot) => Some(Section::Matrix),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_dense_and_names_unique() {
        for (code, op) in Op::ALL.iter().enumerate() {
            assert_eq!(Op::from_code(code as u8), Some(*op));
            assert_eq!(*op as usize, code);
            let same = Op::ALL.iter().filter(|o| o.mnemonic() == op.mnemonic());
            assert_eq!(same.count(), 1, "{}", op.mnemonic());
        }
        assert_eq!(Op::from_code(Op::ALL.len() as u8), None);
    }

    #[test]
    fn editions_are_found_by_fingerprint_and_groups() {
        for edition in EDITIONS {
            assert_eq!(Edition::find(edition.fingerprint), Some(edition));
            assert_eq!(Edition::of_groups(edition.groups()), edition);
        }
        assert_eq!(Edition::find(FINGERPRINT ^ 1), None);
        assert_eq!(Edition::of_groups(0), EDITIONS[0]);
        let [.., last] = EDITIONS;
        assert_eq!(usize::from(last.operations), Op::ALL.len());
        assert_eq!(
            last.groups(),
            Group::ALL.map(Group::bit).iter().sum::<u16>()
        );
    }

    #[test]
    fn notation_names_exactly_the_operands() {
        for op in Op::ALL {
            let [a, b] = op.operands();
            let text = op.notation();
            assert_eq!(text.contains("{a}"), a != Operand::None, "{op:?}");
            assert_eq!(text.contains("{b}"), b != Operand::None, "{op:?}");
            assert_eq!(
                text.contains("{d}"),
                op.destination() != Destination::None,
                "{op:?}"
            );
        }
    }
}
