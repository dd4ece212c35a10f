//! `tpg export`

mod unit;

use std::fs;
use std::path::{Path, PathBuf};

use tpg_runtime::Policy;

use tpg_tasks::console::{command_line, print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::export;

/// Words of C and C++, and names within a module, that a module cannot be named after.
const RESERVED: &[&str] = &[
    "auto",
    "break",
    "case",
    "char",
    "const",
    "continue",
    "default",
    "do",
    "double",
    "else",
    "enum",
    "extern",
    "float",
    "for",
    "goto",
    "if",
    "inline",
    "int",
    "long",
    "register",
    "restrict",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "struct",
    "switch",
    "typedef",
    "union",
    "unsigned",
    "void",
    "volatile",
    "while",
    "bool",
    "true",
    "false",
    "copy",
    "clamp",
    "or_zero",
    "limited",
    "join",
    "scaled",
    "halvings",
    "exponential",
    "exponential_less_one",
    "logarithm",
    "upper",
    "power_of",
    "power_of_two",
    "two_to",
    "with_sign_of",
    "bits_of",
    "float_of",
    "sine_from",
    "remainder_of_turns",
    "perceive",
    "perceptible",
    "is_seen",
    "log2_of",
    "log2_near_one",
    "self",
    "main",
    "alignas",
    "alignof",
    "and",
    "asm",
    "catch",
    "class",
    "compl",
    "constexpr",
    "decltype",
    "delete",
    "explicit",
    "export",
    "friend",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "not",
    "nullptr",
    "operator",
    "or",
    "private",
    "protected",
    "public",
    "template",
    "this",
    "throw",
    "try",
    "typeid",
    "typename",
    "using",
    "virtual",
    "xor",
];

/// Arguments of `tpg export`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// Write the policy as a Rust module that needs tpg-runtime alone.
    #[arg(long, value_name = "OUT.rs", required_unless_present_any = ["c", "fmu"])]
    rust: Option<PathBuf>,
    /// Write the policy as C (C99 or later, or C++17): OUT.c and OUT.h; names in it begin with the file's.
    #[arg(long, value_name = "OUT.c")]
    c: Option<PathBuf>,
    /// Write the policy as a co-simulation unit of FMI 3.0, with a shared library that `cc` (or `$CC`) compiles for this machine.
    #[arg(long, value_name = "OUT.fmu")]
    fmu: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let name_of_c = |path| module_name(path, &["c", "h"]);
    let module = args.c.as_deref().map(name_of_c).transpose()?;
    let name_of_fmu = |path| module_name(path, &["fmu"]);
    let unit = args.fmu.as_deref().map(name_of_fmu).transpose()?;
    let mut written: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    if let Some(path) = &args.rust {
        let command = export_command(&args.file, "--rust", path);
        written.push((path.clone(), export::rust(&policy, &command).into_bytes()));
    }
    if let (Some(path), Some(name)) = (&args.c, module) {
        let command = export_command(&args.file, "--c", path);
        let module = export::c(&policy, name, &command);
        written.push((path.with_extension("c"), module.source.into_bytes()));
        written.push((path.with_extension("h"), module.header.into_bytes()));
    }
    if let (Some(path), Some(name)) = (&args.fmu, unit) {
        let command = export_command(&args.file, "--fmu", path);
        let unit = unit::build(&policy, name, &command)?;
        written.push((path.clone(), unit));
    }
    for (path, content) in &written {
        fs::write(path, content).or_unwritable(path)?;
    }
    if args.json {
        let files: Vec<String> = written
            .iter()
            .map(|(path, _)| path.display().to_string())
            .collect();
        print_json(&serde_json::json!({ "files": files }))?;
    } else {
        for (path, content) in &written {
            let size = std::str::from_utf8(content).map_or_else(
                |_| format!("{} bytes", content.len()),
                |text| format!("{} lines", text.lines().count()),
            );
            print(format_args!("{}: {size}", path.display()))?;
        }
    }
    Ok(Status::Fine)
}

/// The command that writes one file, as the file itself names it: without folders, so that the text is the same wherever
/// it is made.
fn export_command(policy: &Path, flag: &str, out: &Path) -> String {
    let base = |path: &Path| path.file_name().unwrap_or_default().display().to_string();
    command_line(["tpg", "export", &base(policy), flag, &base(out)])
}

/// The name of a C module or unit: that of its file, which must be an identifier and have one of the extensions or none.
fn module_name<'p>(path: &'p Path, extensions: &[&str]) -> Result<&'p str, Failure> {
    let extension = path
        .extension()
        .is_none_or(|extension| extensions.iter().any(|known| extension == *known));
    let name = path
        .file_stem()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let right = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(letters);
    if right && extension && !RESERVED.contains(&name) {
        return Ok(name);
    }
    Err(Failure::usage(anyhow::anyhow!(
        "cannot name a C module {}: give a file such as champion.{}, whose name has only letters, digits and _ and is not a C keyword",
        path.display(),
        extensions[0]
    )))
}
