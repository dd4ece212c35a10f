//! Finds the most stack that a function of a linked program can use, without running the program. It adds up what the
//! instructions take from the stack pointer, and follows the calls.
//!
//! A function counts with the sum of what it takes on all its paths. A jump to another function counts as a call. Both
//! rules can only make the bound too high. A call through a pointer counts as a call of every function whose address is
//! in constant data or is formed by reachable code. Recursion has no bound and is an error. So is an instruction that
//! moves the stack pointer by an unknown amount. Interrupt handlers need stack in addition.

mod code;
mod riscv;
mod thumb;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use object::{
    Architecture, Object as _, ObjectSection as _, ObjectSymbol as _, SectionKind, SymbolKind,
};

use code::Code;

/// Why no bound of the stack was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StackError {
    /// The program is for another kind of processor.
    #[error("it is no program for an ARM Cortex-M or a 32-bit RISC-V")]
    Unknown,
    /// The program cannot be read.
    #[error(transparent)]
    Read(#[from] std::io::Error),
    /// The program's file format is damaged.
    #[error(transparent)]
    Format(#[from] object::Error),
    /// The function is missing.
    #[error("it has no function {0}")]
    Missing(String),
    /// An instruction moves the stack pointer by an unknown amount.
    #[error("{function} moves the stack pointer by an unknown amount, at {address:#x}")]
    Dynamic {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u64,
    },
    /// A function calls itself, directly or through others.
    #[error("{0} can call itself")]
    Recursion(String),
}

/// A linked program.
struct Program<'d> {
    arm: bool,
    /// Where the processor starts. No code calls this address, but a constant may look like it.
    begin: u64,
    /// Names of functions by address.
    names: BTreeMap<u64, &'d str>,
    /// End addresses of functions by start address. The two are equal if the function's size is unknown.
    ends: BTreeMap<u64, u64>,
    /// Sections of code: address and bytes.
    text: Vec<(u64, &'d [u8])>,
    /// Words in constant data that may be addresses.
    constants: BTreeSet<u64>,
    /// Addresses within code sections where data starts (true) or code starts (false).
    data_begins: BTreeMap<u64, bool>,
}

/// The most stack, in bytes, that a function can use, including everything it calls. `entry` is part of the function's
/// mangled name.
///
/// # Errors
/// Every [`StackError`] is possible.
pub fn bound(path: &Path, entry: &str) -> Result<u64, StackError> {
    let bytes = fs::read(path)?;
    let program = Program::parse(&bytes)?;
    let entry = program.named(entry)?;
    let graph = program.reached_from(entry)?;
    let mut bounds = BTreeMap::new();
    program.most(entry, &graph, &mut bounds, &mut Vec::new())
}

/// The bytes of stack that the caller of `entry` uses itself. If there are several callers, the largest value.
///
/// # Errors
/// [`StackError`]. `Missing` also means that nothing calls `entry`.
pub fn callers_frame(path: &Path, entry: &str) -> Result<u64, StackError> {
    let bytes = fs::read(path)?;
    let program = Program::parse(&bytes)?;
    let callee = program.named(entry)?;
    let mut most = None;
    for function in program.names.keys().filter(|function| **function != callee) {
        // Some functions have no known frame, such as a handler in assembly. They are skipped. If one is the only
        // caller, the search ends with an error.
        let Ok(code) = program.decode(*function) else {
            continue;
        };
        if code.calls.contains(&callee) || code.jumps.contains(&callee) {
            most = most.max(Some(code.frame));
        }
    }
    most.ok_or_else(|| StackError::Missing(format!("that calls {entry}")))
}

impl<'d> Program<'d> {
    fn parse(bytes: &'d [u8]) -> Result<Self, StackError> {
        let file = object::File::parse(bytes)?;
        let arm = match file.architecture() {
            Architecture::Arm => true,
            Architecture::Riscv32 => false,
            _ => return Err(StackError::Unknown),
        };
        let mut program = Program {
            arm,
            begin: file.entry(),
            names: BTreeMap::new(),
            ends: BTreeMap::new(),
            text: Vec::new(),
            constants: BTreeSet::new(),
            data_begins: BTreeMap::new(),
        };
        for section in file.sections() {
            match section.kind() {
                SectionKind::Text => program.text.push((section.address(), section.data()?)),
                // The processor uses the interrupt table. No code calls the addresses in it.
                _ if section.name() == Ok(".vector_table") => {}
                SectionKind::ReadOnlyData | SectionKind::Data => {
                    program.constants.extend(words(section.data()?));
                }
                _ => {}
            }
        }
        for symbol in file.symbols() {
            let (name, address) = (symbol.name().unwrap_or_default(), symbol.address());
            if symbol.kind() == SymbolKind::Text {
                // Symbols of Thumb code have odd addresses, as pointers to it do.
                let start = if arm { address & !1 } else { address };
                program.names.insert(start, name);
                program.ends.insert(start, start + symbol.size());
            } else if let Some(mark) = name.strip_prefix('$') {
                program.data_begins.insert(address, mark.starts_with('d'));
            }
        }
        Ok(program)
    }

    /// The function whose mangled name contains `part`.
    fn named(&self, part: &str) -> Result<u64, StackError> {
        let found = self.names.iter().find(|(_, name)| name.contains(part));
        found.map_or_else(
            || Err(StackError::Missing(part.to_owned())),
            |(at, _)| Ok(*at),
        )
    }

    /// The function that a word points to. Pointers to Thumb code are odd.
    fn pointed(&self, word: u64) -> Option<u64> {
        let start = if self.arm { word.checked_sub(1)? } else { word };
        let possible = word != self.begin && (!self.arm || word & 1 == 1);
        (possible && self.names.contains_key(&start)).then_some(start)
    }

    fn name(&self, function: u64) -> String {
        (self.names.get(&function)).map_or_else(|| format!("{function:#x}"), |n| (*n).to_owned())
    }

    /// The function that an address lies in.
    fn function_at(&self, address: u64) -> Option<u64> {
        (self.names.range(..=address).next_back()).map(|(start, _)| *start)
    }

    fn decode(&self, function: u64) -> Result<Code, StackError> {
        let section = (self.text.iter()).find_map(|(address, bytes)| {
            let from = usize::try_from(function.checked_sub(*address)?).ok()?;
            Some((bytes.get(from..)?, address + bytes.len() as u64))
        });
        let Some((bytes, end)) = section else {
            return Err(StackError::Missing(self.name(function)));
        };
        let next = self.names.range(function + 1..).next();
        let end = next.map_or(end, |(next, _)| end.min(*next));
        // The linker may pad after a function. The padding could decode as jumps, so stop at the known size.
        let own = (self.ends.get(&function)).filter(|own| **own > function);
        let end = own.map_or(end, |own| end.min(*own));
        let bytes = &bytes[..(end - function) as usize];
        let code = if self.arm {
            thumb::decode(function, bytes, |at| {
                let mark = self.data_begins.range(..=at).next_back();
                mark.is_some_and(|(_, data)| *data)
            })
        } else {
            // Addresses within a function that stand in constant data belong to a switch.
            // A name may stand where no code follows.
            let inside = function + 1..end.max(function + 1);
            let switches = self.constants.range(inside).next().is_some();
            riscv::decode(function, bytes, switches)
        };
        match code.dynamic {
            None => Ok(code),
            Some(address) => Err(StackError::Dynamic {
                function: self.name(function),
                address,
            }),
        }
    }

    /// Every reachable function, with its frame in bytes and the functions that it calls.
    fn reached_from(&self, entry: u64) -> Result<BTreeMap<u64, (u64, BTreeSet<u64>)>, StackError> {
        let mut codes = BTreeMap::new();
        let pointers = self.constants.iter().filter_map(|word| self.pointed(*word));
        let mut pointed: BTreeSet<u64> = pointers.collect();
        let mut open = BTreeSet::from([entry]);
        while let Some(function) = open.pop_first() {
            let mut code = self.decode(function)?;
            let left = code.jumps.iter().filter_map(|at| self.function_at(*at));
            code.calls.extend(left.filter(|other| *other != function));
            pointed.extend(code.addresses.iter().filter_map(|word| self.pointed(*word)));
            open.extend(&code.calls);
            codes.insert(function, code);
            if codes.values().any(|code| code.through_pointer) {
                open.extend(&pointed);
            }
            open.retain(|function| !codes.contains_key(function));
        }
        let mut graph = BTreeMap::new();
        for (function, mut code) in codes {
            if code.through_pointer {
                code.calls.extend(&pointed);
            }
            graph.insert(function, (code.frame, code.calls));
        }
        Ok(graph)
    }

    fn most(
        &self,
        function: u64,
        graph: &BTreeMap<u64, (u64, BTreeSet<u64>)>,
        bounds: &mut BTreeMap<u64, u64>,
        callers: &mut Vec<u64>,
    ) -> Result<u64, StackError> {
        if let Some(bound) = bounds.get(&function) {
            return Ok(*bound);
        }
        if let Some(begin) = callers.iter().position(|caller| *caller == function) {
            let circle = callers[begin..].iter().chain([&function]);
            let names: Vec<String> = circle.map(|caller| self.name(*caller)).collect();
            return Err(StackError::Recursion(names.join(" calls ")));
        }
        callers.push(function);
        let (frame, targets) = &graph[&function];
        let mut deepest = 0;
        for target in targets {
            deepest = deepest.max(self.most(*target, graph, bounds, callers)?);
        }
        callers.pop();
        bounds.insert(function, frame + deepest);
        Ok(frame + deepest)
    }
}

/// Words of a section that may be addresses.
fn words(bytes: &[u8]) -> impl Iterator<Item = u64> {
    (bytes.as_chunks::<4>().0.iter()).map(|word| u64::from(u32::from_le_bytes(*word)))
}
