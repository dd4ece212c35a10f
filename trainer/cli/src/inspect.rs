//! `tpg inspect`

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tpg_runtime::blob::ActionKind;
use tpg_runtime::tables::{Program, Target};
use tpg_runtime::{Capacities, Policy};

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::disassemble::{Wins, disassemble, dot, inputs_used, svg};
use tpg_trainer::lower::Mode;
use tpg_trainer::session;

use crate::replay::decide_again;

/// Arguments of `tpg inspect`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Exported policy, or a run's folder: its champion, compared with how it evolved.
    #[arg(value_name = "FILE.tpg|DIR")]
    file: PathBuf,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
    /// Print every team and program in readable notation instead.
    #[arg(long, conflicts_with = "json")]
    disassemble: bool,
    /// Write the graph of teams and programs to a file, for Graphviz.
    #[arg(long, value_name = "FILE")]
    dot: Option<PathBuf>,
    /// Draw the graph: teams as cards, programs as rows.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Trace of the policy (`tpg eval --trace`): programs are drawn in the order in which they win.
    #[arg(long, value_name = "FILE.trace", requires = "svg")]
    trace: Option<PathBuf>,
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
    worst_case_members: u32,
    state_bytes: usize,
    blob_bytes: usize,
    vector_width: u16,
    register_mode: &'static str,
    reset_scope: &'static str,
    memory: &'static str,
    control_period_us: u32,
    /// Observations in the window, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    history: Option<u16>,
    /// What happens to observations before the programs see them.
    #[serde(skip_serializing_if = "Option::is_none")]
    front_end: Option<FrontEndSummary>,
    /// Number of programs of each output, where outputs have programs of their own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    programs_of_outputs: Vec<usize>,
    /// Of a run's champion: the graph before lowering dropped what cannot matter.
    #[serde(skip_serializing_if = "Option::is_none")]
    as_evolved: Option<AsEvolved>,
}

/// What a front end does and takes; its part of the policy's figures.
#[derive(Debug, Serialize)]
struct FrontEndSummary {
    missing: &'static str,
    degree: u8,
    believed: Vec<String>,
    instructions_visible: u32,
    instructions_model: u32,
    state_bytes: usize,
    blob_bytes: usize,
}

fn front_end(policy: &Policy<'_>) -> Option<FrontEndSummary> {
    let front_end = policy.front_end()?;
    let (header, inputs) = (policy.header(), policy.inputs());
    let believed = |column: &u16| front_end.columns.contains(&column.to_le_bytes());
    Some(FrontEndSummary {
        missing: front_end.fallback.name(),
        degree: front_end.degree,
        believed: (0u16..)
            .zip(inputs)
            .filter(|(column, _)| believed(column))
            .map(|(_, (name, _))| name.to_owned())
            .collect(),
        instructions_visible: front_end.visible_instructions(),
        instructions_model: front_end.model_instructions(header),
        state_bytes: 4 * front_end.words(header),
        blob_bytes: policy.tables().front_end.len(),
    })
}

fn programs_of_outputs(policy: &Policy<'_>) -> Vec<usize> {
    if policy.header().action_kind != ActionKind::Each {
        return Vec::new();
    }
    let targets = policy.tables().programs.iter();
    let targets = targets.map(|bytes| Program::from_bytes(bytes).target);
    let programs_of = |k| targets.clone().filter(|t| *t == Target::Atomic(k)).count();
    (0..policy.header().actions).map(programs_of).collect()
}

/// Sizes of a graph as it evolved.
#[derive(Debug, Serialize)]
struct AsEvolved {
    instructions: usize,
    state_bytes: usize,
    blob_bytes: usize,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let (bytes, whole) = if args.file.is_dir() {
        let checkpoint = session::load(&args.file.join("checkpoint"))
            .or_bad_input(format!("{file} holds no run"))?;
        let session = checkpoint.session;
        let whole = session.lower_champion(Mode::Whole);
        (session.export_champion()?, Some(whole?))
    } else {
        let read = std::fs::read(&args.file);
        (read.or_bad_input(format!("cannot read {file}"))?, None)
    };
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    if let Some(path) = &args.dot {
        std::fs::write(path, dot(&policy)).or_unwritable(path)?;
    }
    if let Some(path) = &args.svg {
        let trace = args.trace.as_deref();
        let wins = trace.map(|trace| wins(trace, &args.file, &bytes));
        let drawing = svg(&policy, wins.transpose()?.as_ref());
        std::fs::write(path, drawing).or_unwritable(path)?;
    }
    let mut summary = summarise(&policy, bytes.len());
    if let Some(whole) = &whole {
        let evolved = summarise(&Policy::load(whole)?, whole.len());
        summary.instructions = evolved.instructions;
        summary.as_evolved = Some(AsEvolved {
            instructions: evolved.instructions,
            state_bytes: evolved.state_bytes,
            blob_bytes: evolved.blob_bytes,
        });
    }
    if args.disassemble {
        print(disassemble(&policy).trim_end())?;
    } else if args.json {
        print_json(&summary)?;
    } else {
        print(summary)?;
    }
    Ok(Status::Fine)
}

/// How often which program won in a trace.
fn wins(trace: &Path, file: &Path, bytes: &[u8]) -> Result<Wins, Failure> {
    let mut wins = Wins::new();
    decide_again(trace, file, bytes, |decision| {
        for visit in &decision.path {
            let winners = match visit.outputs.as_slice() {
                [] => std::slice::from_ref(&visit.winner),
                outputs => outputs,
            };
            for winner in winners {
                *wins.entry((visit.team, *winner)).or_default() += 1;
            }
        }
    })?;
    Ok(wins)
}

fn summarise(policy: &Policy<'_>, blob_bytes: usize) -> Summary {
    let (header, tables) = (policy.header(), policy.tables());
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
        inputs_used: inputs_used(policy, tables.code),
        worst_case_instructions: policy.bounds().instructions,
        worst_case_weighted_operations: policy.bounds().weighted_operations,
        worst_case_members: policy.bounds().members,
        state_bytes: Capacities::needed_by(header).state_bytes(),
        blob_bytes,
        vector_width: header.width,
        register_mode: header.register_mode.name(),
        reset_scope: header.reset_scope.name(),
        memory: header.memory_model.name(),
        control_period_us: header.control_period_us,
        history: (header.history > 1).then_some(header.history),
        front_end: front_end(policy),
        programs_of_outputs: programs_of_outputs(policy),
        as_evolved: None,
    }
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
        if !self.programs_of_outputs.is_empty() {
            let each: Vec<String> = self
                .programs_of_outputs
                .iter()
                .map(usize::to_string)
                .collect();
            let each = each.join(", ");
            writeln!(f, "outputs         from programs of their own: {each}")?;
        }
        writeln!(
            f,
            "instructions    {}, {} effective",
            self.instructions, self.effective_instructions
        )?;
        writeln!(
            f,
            "worst decision  {} instructions, {} members, {} weighted operations in all",
            self.worst_case_instructions,
            self.worst_case_members,
            self.worst_case_weighted_operations
        )?;
        writeln!(f, "inputs used     {}", self.inputs_used.join(", "))?;
        writeln!(
            f,
            "registers       {}, reset {}, W = {}, memory {}",
            self.register_mode, self.reset_scope, self.vector_width, self.memory
        )?;
        writeln!(f, "control period  {} us", self.control_period_us)?;
        if let Some(history) = self.history {
            writeln!(f, "history         the last {history} observations")?;
        }
        if let Some(front_end) = &self.front_end {
            let model = match front_end.degree {
                0 => String::new(),
                degree => format!(" by degree {degree} of {}", front_end.believed.join(", ")),
            };
            writeln!(
                f,
                "front end       standardises, missing: {}{model}; {} instructions, {} of a model, {} bytes of state, {} of blob",
                front_end.missing,
                front_end.instructions_visible,
                front_end.instructions_model,
                front_end.state_bytes,
                front_end.blob_bytes
            )?;
        }
        write!(
            f,
            "bytes           {} of state (RAM), {} of blob (flash)",
            self.state_bytes, self.blob_bytes
        )?;
        if let Some(evolved) = &self.as_evolved {
            write!(
                f,
                "\nas evolved      {} of state, {} of blob",
                evolved.state_bytes, evolved.blob_bytes
            )?;
        }
        Ok(())
    }
}
