//! `tpg export`

use std::fs;
use std::io::Write as _;
use std::path::{Display, Path, PathBuf};

use tpg_runtime::Policy;

use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::score::print_json;
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
    #[arg(long, value_name = "OUT.rs", required_unless_present = "c")]
    rust: Option<PathBuf>,
    /// Write the policy as C (C99 or later, or C++17): OUT.c and OUT.h; names in it begin with the file's.
    #[arg(long, value_name = "OUT.c")]
    c: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let mut written = Vec::new();
    let name = args.c.as_deref().map(module_name).transpose()?;
    // The written text names no folders, so that it is the same wherever it is made.
    let source = base_name(&args.file);
    if let Some(path) = &args.rust {
        let command = format!("tpg export {source} --rust {}", base_name(path));
        written.push((path.clone(), export::rust(&policy, &command)));
    }
    if let (Some(path), Some(name)) = (&args.c, name) {
        let command = format!("tpg export {source} --c {}", base_name(path));
        let module = export::c(&policy, name, &command);
        written.push((path.with_extension("c"), module.source));
        written.push((path.with_extension("h"), module.header));
    }
    for (path, text) in &written {
        fs::write(path, text).or_usage(format!("cannot write {}", path.display()))?;
    }
    if args.json {
        let files: Vec<String> = written
            .iter()
            .map(|(path, _)| path.display().to_string())
            .collect();
        print_json(&serde_json::json!({ "files": files }))?;
    } else {
        for (path, text) in &written {
            writeln!(
                std::io::stdout().lock(),
                "{}: {} lines",
                path.display(),
                text.lines().count()
            )?;
        }
    }
    Ok(Status::Fine)
}

/// The name of a file, without its folder.
fn base_name(path: &Path) -> Display<'_> {
    Path::new(path.file_name().unwrap_or_default()).display()
}

/// The name of a C module: that of its file, which must be an identifier.
fn module_name(path: &Path) -> Result<&str, Failure> {
    let extension = path
        .extension()
        .is_none_or(|extension| extension == "c" || extension == "h");
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
        "cannot name a C module {}: give a file such as champion.c, of letters, digits and _, that is no word of C",
        path.display()
    )))
}
