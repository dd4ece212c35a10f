//! `tpg sign`

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;
use tpg_runtime::signature::{PUBLIC_PREFIX, parse_key, verify};
use tpg_runtime::{Blob, Policy};
use tpg_tasks::console::{note, print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::signature::{SecretKey, sign};

/// Arguments of `tpg sign`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// Secret key to sign with, which `tpg keygen` wrote.
    #[arg(
        long,
        value_name = "KEY",
        requires = "out",
        required_unless_present = "verify"
    )]
    key: Option<PathBuf>,
    /// Where to write the signed policy, in format version 3.
    #[arg(long, value_name = "OUT.tpg", requires = "key")]
    out: Option<PathBuf>,
    /// Number of the release, which a board may compare: it refuses a lower one than it has.
    #[arg(long, value_name = "N", requires = "key")]
    release: Option<u32>,
    /// Verify the signature of FILE.tpg by this public key, and write nothing.
    #[arg(long, value_name = "KEY.pub", conflicts_with = "key")]
    verify: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    match (&args.key, &args.out, &args.verify) {
        (Some(key), Some(out), None) => make(args, &policy, key, out)?,
        (_, _, Some(key)) => check(args, &bytes, key)?,
        _ => {
            return Err(Failure::usage(anyhow::anyhow!(
                "give --key and --out, or --verify"
            )));
        }
    }
    Ok(Status::Fine)
}

fn make(args: &Args, policy: &Policy<'_>, key: &Path, out: &Path) -> Result<(), Failure> {
    let secret = SecretKey::parse(&read(key)?);
    let secret = secret.ok_or_else(|| no_key(key, "secret"))?;
    let signed = sign(policy, &secret, args.release)
        .or_bad_input(format!("cannot sign {}", args.file.display()))?;
    // Only version 3 has sections.
    if policy.header().sections == 0 && policy.header().front_end.is_some() {
        note(format_args!(
            "{} has format version 2; {} has version 3, in which a missing value is NaN and zeros are values",
            args.file.display(),
            out.display()
        ));
    }
    fs::write(out, &signed).or_unwritable(out)?;
    let public = secret.public();
    let key: String = (public.iter().take(8))
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let release = args.release.unwrap_or(policy.header().release);
    if args.json {
        return print_json(&json!({ "bytes": signed.len(), "key": key, "release": release }));
    }
    print(format_args!(
        "{}: {} bytes, release {release}, signed by key {key}",
        out.display(),
        signed.len()
    ))
}

fn check(args: &Args, bytes: &[u8], key: &Path) -> Result<(), Failure> {
    let public = parse_key(&read(key)?, PUBLIC_PREFIX).ok_or_else(|| no_key(key, "public"))?;
    let file = args.file.display();
    let refused = || format!("{file} does not count as signed by {}", key.display());
    let blob = Blob::decode(bytes).or_bad_input(format!("cannot use {file}"))?;
    verify(&blob, &public).or_bad_input(refused())?;
    let release = blob.header().release;
    if args.json {
        return print_json(&json!({ "verified": true, "release": release }));
    }
    print(format_args!(
        "{file}: release {release}, signed by the owner of {}",
        key.display()
    ))
}

fn read(key: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(key).or_bad_input(format!("cannot read {}", key.display()))
}

fn no_key(key: &Path, kind: &str) -> Failure {
    Failure::bad_input(anyhow::anyhow!(
        "{} is no {kind} key: `tpg keygen KEY` writes the secret key to KEY and the public one to KEY.pub",
        key.display()
    ))
}
