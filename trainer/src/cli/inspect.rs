//! `tpg inspect`

use std::collections::BTreeSet;
use std::fmt;
use std::io::Write as _;
use std::path::PathBuf;

use serde::Serialize;
use tpg_runtime::Policy;
use tpg_runtime::isa::Operand;
use tpg_runtime::tables::Instruction;

use super::{Failure, Fault as _, Status, print_json};

/// Arguments of `tpg inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

/// What a policy contains and needs; the fields are the keys of `--json`.
#[derive(Debug, Serialize)]
struct Summary {
    task: String,
    observability: String,
    provenance: String,
    teams: u16,
    programs: u16,
    instructions: usize,
    effective_instructions: usize,
    inputs_used: Vec<String>,
    worst_case_instructions: u32,
    worst_case_weighted_operations: u64,
    state_bytes: usize,
    blob_bytes: usize,
    vector_width: u16,
    register_mode: &'static str,
    reset_scope: &'static str,
    memory: &'static str,
    control_period_us: u32,
}

pub(super) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = std::fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let summary = summarise(&policy, bytes.len());
    if args.json {
        print_json(&summary)?;
    } else {
        writeln!(std::io::stdout().lock(), "{summary}")?;
    }
    Ok(Status::Fine)
}

fn summarise(policy: &Policy<'_>, blob_bytes: usize) -> Summary {
    let (header, tables) = (policy.header(), policy.tables());
    let names: Vec<&str> = policy.inputs().map(|(name, _)| name).collect();
    let used = inputs_used(policy);
    let memory_bytes = 4 * header.words as usize
        + 4 * usize::from(header.programs)
        + usize::from(header.teams)
        + 16 * usize::from(header.streams);
    Summary {
        task: tables.task.to_owned(),
        observability: tables.observability.to_owned(),
        provenance: header
            .provenance
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect(),
        teams: header.teams,
        programs: header.programs,
        instructions: tables.code.len(),
        // An exported policy holds nothing else: lowering has dropped what cannot matter.
        effective_instructions: tables.code.len(),
        inputs_used: used
            .iter()
            .filter_map(|k| Some((*names.get(*k)?).to_owned()))
            .collect(),
        worst_case_instructions: policy.bounds().instructions,
        worst_case_weighted_operations: policy.bounds().weighted_operations,
        state_bytes: memory_bytes,
        blob_bytes,
        vector_width: header.width,
        register_mode: header.register_mode.name(),
        reset_scope: header.reset_scope.name(),
        memory: header.memory_model.name(),
        control_period_us: header.control_period_us,
    }
}

/// Numbers of the observation's elements that some instruction reads.
fn inputs_used(policy: &Policy<'_>) -> BTreeSet<usize> {
    let header = policy.header();
    let (inputs, window) = (
        usize::from(header.observation_len),
        usize::from(header.window),
    );
    let width = usize::from(header.width);
    let mut used = BTreeSet::new();
    for instruction in policy
        .tables()
        .code
        .iter()
        .filter_map(Instruction::from_bytes)
    {
        let operands = instruction.op.operands();
        for (kind, at) in operands.into_iter().zip([instruction.a, instruction.b]) {
            let len = match kind {
                Operand::S | Operand::VElement | Operand::MElement | Operand::SOrVElement => 1,
                Operand::V => width,
                Operand::M => width * width,
                _ => continue,
            };
            let at = usize::from(at);
            if at < window {
                used.extend((at..at + len).map(|k| k % inputs));
            }
        }
    }
    used
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "task            {} ({})", self.task, self.observability)?;
        writeln!(f, "provenance      {}", self.provenance)?;
        writeln!(
            f,
            "graph           {} teams, {} programs",
            self.teams, self.programs
        )?;
        writeln!(f, "instructions    {}, all effective", self.instructions)?;
        writeln!(
            f,
            "worst decision  {} instructions, {} weighted operations",
            self.worst_case_instructions, self.worst_case_weighted_operations
        )?;
        writeln!(f, "inputs used     {}", self.inputs_used.join(", "))?;
        writeln!(
            f,
            "registers       {}, reset {}, W = {}, memory {}",
            self.register_mode, self.reset_scope, self.vector_width, self.memory
        )?;
        writeln!(f, "control period  {} us", self.control_period_us)?;
        write!(
            f,
            "bytes           {} of state (RAM), {} of blob (flash)",
            self.state_bytes, self.blob_bytes
        )
    }
}
