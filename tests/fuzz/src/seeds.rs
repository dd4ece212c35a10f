//! Seeds: inputs as they really occur, made of the repository's own files.

use std::path::{Path, PathBuf};
use std::{env, fs};

use tpg_runtime::wire::{Answer, Frame, Refusal, Request};
use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tasks::eval::Controller as _;
use tpg_tasks::trace::{Header, TracingController};
use tpg_trainer::config::{Preset, resolve};
use tpg_trainer::session::{LogMark, Session, Snapshot};

use super::BUILT_IN;

/// Seeds of a target.
///
/// # Panics
/// If a file of the repository is missing.
#[must_use]
pub fn seeds(target: &str) -> Vec<Vec<u8>> {
    match target {
        "loader" => files(
            &[
                "tests/golden/v1",
                "tests/golden/v2",
                "tests/golden/v3",
                "docs/champions",
            ],
            "tpg",
        ),
        "policy" => seeds("loader").into_iter().map(observed).collect(),
        "wire" => messages(),
        "session" => scripts(),
        "checkpoint" => vec![checkpoint()],
        "configuration" => files(
            &[
                "trainer/presets/variants",
                "trainer/presets/tasks",
                "trainer/presets",
            ],
            "toml",
        ),
        "task" => files(&["docs/examples/crane"], "toml"),
        "trace" => vec![recorded()],
        "rows" => files(&["docs/experiments/chapter-2-reduced/rows"], "csv")
            .into_iter()
            .take(9)
            .collect(),
        _ => Vec::new(),
    }
}

/// Inputs that once broke a promise of a target.
///
/// # Panics
/// If they cannot be read.
#[must_use]
pub fn regressions(target: &str) -> Vec<Vec<u8>> {
    let folder = root().join("tests/fuzz/regressions").join(target);
    if folder.exists() {
        all(&folder, None)
    } else {
        Vec::new()
    }
}

/// Writes seeds and regressions of a target into the folder that the environment's `TPG_FUZZ_SEEDS` names, if it does.
///
/// # Panics
/// If they cannot be written.
pub fn write_seeds(target: &str) {
    let Some(folder) = env::var_os("TPG_FUZZ_SEEDS") else {
        return;
    };
    for (k, input) in seeds(target)
        .into_iter()
        .chain(regressions(target))
        .enumerate()
    {
        fs::write(Path::new(&folder).join(format!("seed-{k}")), input).expect("a folder for seeds");
    }
}

/// The repository. The targets are a part of two packages, one in the folder of the other.
fn root() -> PathBuf {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = folders.find(|folder| folder.join("docs/champions").is_dir());
    root.expect("the repository").to_owned()
}

fn files(folders: &[&str], extension: &str) -> Vec<Vec<u8>> {
    let folders = folders.iter().map(|folder| root().join(folder));
    folders
        .flat_map(|folder| all(&folder, Some(extension)))
        .collect()
}

/// The files of a folder, sorted by name.
fn all(folder: &Path, extension: Option<&str>) -> Vec<Vec<u8>> {
    let entries =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.retain(|path| {
        path.is_file()
            && extension.is_none_or(|wanted| path.extension().is_some_and(|found| found == wanted))
    });
    paths.sort();
    paths
        .iter()
        .map(|path| fs::read(path).expect("readable"))
        .collect()
}

/// A file, and observations with ordinary, special and missing values.
fn observed(mut file: Vec<u8>) -> Vec<u8> {
    const VALUES: [f32; 16] = [
        0.5,
        -1.0,
        f32::NAN,
        0.0,
        -0.0,
        3.4e38,
        1e-40,
        f32::INFINITY,
        7.0,
        -0.25,
        1e-6,
        -8193.0,
        0.1,
        100.0,
        -3.0,
        2.0,
    ];
    file.extend(VALUES.iter().flat_map(|value| value.to_le_bytes()));
    file
}

/// Messages without checksum and framing.
fn messages() -> Vec<Vec<u8>> {
    fn message(seq: u32, message: impl serde::Serialize) -> Vec<u8> {
        let mut buffer = [0; 256];
        let frame = Frame { seq, message };
        postcard::to_slice(&frame, &mut buffer)
            .expect("room enough")
            .to_vec()
    }
    vec![
        message(1, Request::Hello),
        message(2, Request::Observe { values: &[0; 44] }),
        message(
            3,
            Request::Store {
                at: 64,
                bytes: &[7; 64],
            },
        ),
        message(
            4,
            Request::Begin {
                bytes: 900,
                contract: 77,
                release: 3,
                forced: true,
            },
        ),
        message(5, Request::Contract { at: 0 }),
        message(6, Answer::Ready),
        message(
            7,
            Answer::Values {
                values: &[0; 12],
                instructions: 40,
            },
        ),
        message(
            8,
            Answer::Refused {
                refusal: Refusal::Capacity,
                detail: 9,
            },
        ),
    ]
}

/// Events at a board, as pairs of event and argument: see `session`.
fn scripts() -> Vec<Vec<u8>> {
    vec![
        // An update that is confirmed, and one that is reverted.
        vec![1, 0, 2, 0, 3, 0, 8, 0, 1, 1, 2, 0, 8, 0, 4, 0, 8, 0],
        // The power fails while a policy is stored, and while it is confirmed.
        vec![7, 40, 1, 0, 2, 0, 8, 0, 1, 2, 2, 0, 7, 1, 3, 0, 8, 0],
        // A damaged file, an erasure, bytes on the line.
        vec![6, 40, 1, 1, 2, 0, 5, 1, 8, 0, 0, 3, 1, 2, 3, 9, 200],
    ]
}

/// The checkpoint of a small run.
fn checkpoint() -> Vec<u8> {
    let preset = Preset::find("cartpole-sr-sm").expect("a preset");
    let small = [
        "evolution.population=6",
        "evolution.children=6",
        "evaluation.episodes=2",
    ];
    let config = resolve(&preset, None, &small.map(str::to_owned)).expect("settings");
    let mut session = Session::new(config, 1).expect("a session");
    let mut pool = session.pool(1).expect("threads");
    session.advance(&mut pool).expect("a generation");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("checkpoint");
    Snapshot::new(&session)
        .save(&path, Vec::new(), LogMark::default())
        .expect("written");
    fs::read(&path).expect("readable")
}

/// A trace of a few decisions.
fn recorded() -> Vec<u8> {
    let policy = Policy::load(BUILT_IN).expect("valid");
    let agent = Box::new(HostAgent::new(policy).expect("fits"));
    let header = Header::new(BUILT_IN, "hopper-v4", "blackout:2/3".to_owned(), 1, 1);
    let mut trace = Vec::new();
    let mut controller = TracingController::new(agent, header, &mut trace).expect("written");
    controller.reset(Reset::Agent, 5).expect("written");
    for step in 0..4_u8 {
        controller
            .decide(&[f32::from(step); 11])
            .expect("its length");
    }
    controller.finish().expect("written");
    trace
}
