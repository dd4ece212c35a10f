//! `tpg keygen`

use std::fs::{OpenOptions, remove_file};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::json;
use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::signature::SecretKey;

/// Arguments of `tpg keygen`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Where to write the secret key; the public key goes to KEY.pub. Neither file may exist.
    #[arg(value_name = "KEY")]
    key: PathBuf,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let mut public = args.key.clone().into_os_string();
    public.push(".pub");
    let public = PathBuf::from(public);
    let key = SecretKey::generate()?;
    write_new(&args.key, &key.text(), true)?;
    if let Err(failure) = write_new(&public, &key.public_text(), false) {
        // Half a pair is of no use, and would be in the way of the next attempt.
        let _ = remove_file(&args.key);
        return Err(failure);
    }
    if args.json {
        print_json(&json!({ "secret": args.key, "public": public }))?;
    } else {
        print(format_args!(
            "secret key in {}, for `tpg sign`; public key in {}, for the firmware",
            args.key.display(),
            public.display()
        ))?;
    }
    Ok(Status::Fine)
}

/// Writes a file that must not exist yet. A secret one can be read by its owner alone, from its first moment on.
fn write_new(path: &Path, text: &str, secret: bool) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if secret {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.mode(0o600);
    }
    #[cfg(not(unix))]
    let _ = secret;
    let mut file = options.open(path).or_unwritable(path)?;
    file.write_all(text.as_bytes()).or_unwritable(path)?;
    file.sync_all().or_unwritable(path)
}
