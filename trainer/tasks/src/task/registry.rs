//! Tasks by name.

use super::families::{self, Family};
use super::memory::CsvSeries;
use super::{Acrobot, CartPole, Pendulum, Randomization, Task, UnknownTask};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

#[cfg(feature = "mujoco")]
use super::mujoco::Robot;

type Make = fn() -> Box<dyn Task>;

/// One task: its full name, whether the name without the version means it, how to make it (`None`: not in this build).
struct Row {
    name: &'static str,
    default: bool,
    make: Option<Make>,
}

/// The row of a robot that the program brings along.
#[cfg(feature = "mujoco")]
macro_rules! robot {
    ($name:literal, $default:literal) => {
        Row {
            name: $name,
            default: $default,
            make: Some(|| Box::new(Robot::builtin($name))),
        }
    };
}
#[cfg(not(feature = "mujoco"))]
macro_rules! robot {
    ($name:literal, $default:literal) => {
        Row {
            name: $name,
            default: $default,
            make: None,
        }
    };
}

static TABLE: &[Row] = &[
    Row {
        name: "cartpole-v1",
        default: true,
        make: Some(|| Box::new(CartPole::new())),
    },
    Row {
        name: "acrobot-v1",
        default: true,
        make: Some(|| Box::new(Acrobot::new())),
    },
    Row {
        name: "pendulum-v1",
        default: true,
        make: Some(|| Box::new(Pendulum::new())),
    },
    robot!("inverted-double-pendulum-v4", true),
    robot!("inverted-double-pendulum-v5", false),
    robot!("hopper-v4", true),
    robot!("hopper-v5", false),
    robot!("half-cheetah-v4", true),
    robot!("half-cheetah-v5", false),
    robot!("inverted-double-pendulum-skip1-v1", true),
    robot!("hopper-skip1-v1", true),
    robot!("hopper-skip1-free-v1", true),
    robot!("half-cheetah-skip1-v1", true),
    robot!("inverted-pendulum-v4", false),
    robot!("inverted-pendulum-v5", true),
    robot!("walker2d-v4", false),
    robot!("walker2d-v5", true),
    robot!("swimmer-v4", false),
    robot!("swimmer-v5", true),
    robot!("reacher-v4", false),
    robot!("reacher-v5", true),
    robot!("pusher-v5", true),
    robot!("ant-v4", false),
    robot!("ant-v5", true),
    robot!("humanoid-v4", false),
    robot!("humanoid-v5", true),
    robot!("humanoid-standup-v4", false),
    robot!("humanoid-standup-v5", true),
];

/// The full names of the tasks that this build can make. A family of tasks is named by its default, such as `tmaze:10-v1`.
#[must_use]
pub fn names() -> &'static [&'static str] {
    static NAMES: LazyLock<Vec<&str>> = LazyLock::new(|| {
        let rows = TABLE.iter().filter(|row| row.make.is_some());
        let families = families::TABLE.iter();
        rows.map(|row| row.name)
            .chain(families.map(|family| family.full))
            .collect()
    });
    &NAMES
}

/// Makes a task by its full name, or by its name without the version, which means the version that the
/// thesis used, or else the latest; or
/// from the file that describes it, whose path ends in `.toml`; or from the column of a file with numbers,
/// `series:FILE.csv:COLUMN`. A task of a family has a parameter in its name, such as `tmaze:100`; without one it is the
/// family's default.
///
/// # Errors
/// [`UnknownTask::NoSuchName`] lists the names and suggests the nearest; [`UnknownTask::NeedsMujoco`] when the build
/// lacks the task's simulator; [`UnknownTask::BadFile`] when a file cannot be read or used; [`UnknownTask::BadParameter`]
/// when the family of the name has no such task.
///
/// # Examples
/// ```
/// # fn main() -> Result<(), tpg_tasks::task::UnknownTask> {
/// let task = tpg_tasks::task::create("cartpole")?;
/// assert_eq!(task.spec().name, "cartpole-v1");
/// # Ok(())
/// # }
/// ```
pub fn create(name: &str) -> Result<Box<dyn Task>, UnknownTask> {
    create_with(name, Randomization::On)
}

/// Makes a task as [`create`] does, with its randomization on or off.
///
/// Initial states and goals of a seed are the same in both cases.
///
/// # Errors
/// Those of [`create`].
pub fn create_with(name: &str, randomization: Randomization) -> Result<Box<dyn Task>, UnknownTask> {
    if let Some(path) = description_file(name) {
        return described(path, randomization);
    }
    if let Some(series) = CsvSeries::of(name) {
        return Ok(Box::new(series?.load()?));
    }
    let row = match find(name)? {
        Found::Row(row) => row,
        Found::Family(family, parameter) => {
            return family
                .make(parameter)
                .ok_or_else(|| UnknownTask::BadParameter {
                    family: family.name,
                    given: parameter.unwrap_or_default().into(),
                    wanted: family.wanted(),
                });
        }
    };
    let make = row.make.ok_or(UnknownTask::NeedsMujoco {
        name: row.name,
        known: names(),
    })?;
    Ok(make())
}

/// What a name stands for.
enum Found<'a> {
    Row(&'static Row),
    /// A task of a family, with its parameter if the name has one.
    Family(&'static Family, Option<&'a str>),
}

fn find(name: &str) -> Result<Found<'_>, UnknownTask> {
    let named = |row: &&Row| row.name == name || row.default && bare(row.name) == name;
    if let Some(row) = TABLE.iter().find(named) {
        return Ok(Found::Row(row));
    }
    if let Some((family, parameter)) = families::find(name) {
        return Ok(Found::Family(family, parameter));
    }
    Err(UnknownTask::NoSuchName {
        name: name.into(),
        nearest: nearest(name),
        known: names(),
    })
}

/// The path of the TOML file that describes a task, where `name` is one instead of a built-in task's name.
#[must_use]
pub fn description_file(name: &str) -> Option<&Path> {
    let path = Path::new(name);
    (path.extension()? == "toml" && !CsvSeries::is_meant(name)).then_some(path)
}

/// Whether a task is made from a file of the user, so that no policy can be scored on it without that file.
#[must_use]
pub fn is_from_file(name: &str) -> bool {
    description_file(name).is_some() || CsvSeries::is_meant(name)
}

/// The name of a task with the path in it replaced; a name without one stays.
fn with_path(name: &str, replaced: impl FnOnce(&Path) -> Option<PathBuf>) -> String {
    let text = |path: &Path| Some(replaced(path)?.to_str()?.to_owned());
    let changed = match (description_file(name), CsvSeries::of(name)) {
        (Some(path), _) => text(path),
        (None, Some(Ok(series))) => (|| {
            let family = name.split_once(':')?.0;
            Some(format!("{family}:{}{}", text(series.path)?, series.rest))
        })(),
        _ => None,
    };
    changed.unwrap_or_else(|| name.to_owned())
}

#[cfg(feature = "mujoco")]
fn described(path: &Path, randomization: Randomization) -> Result<Box<dyn Task>, UnknownTask> {
    let taken: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
    super::mujoco::custom::load(path, &taken, randomization)
}

#[cfg(not(feature = "mujoco"))]
fn described(_: &Path, _: Randomization) -> Result<Box<dyn Task>, UnknownTask> {
    Err(UnknownTask::NeedsMujoco {
        name: "that a file describes",
        known: names(),
    })
}

/// The name of a task, with the path of its file, if it has one, made absolute, so that it means the same in every folder.
#[must_use]
pub fn locate(name: &str) -> String {
    with_path(name, |path| std::path::absolute(path).ok())
}

/// The name of a task, with the path of its file, if it has one, meant relative to a folder.
#[must_use]
pub fn locate_in(folder: &Path, name: &str) -> String {
    with_path(name, |path| Some(folder.join(path)))
}

/// What fixes a task wherever its files lie: its name, or the hash of the files that describe it.
///
/// # Errors
/// [`UnknownTask::BadFile`] where they cannot be read.
pub fn identity(name: &str) -> Result<String, UnknownTask> {
    if let Some(series) = CsvSeries::of(name) {
        return series?.identity();
    }
    let Some(path) = description_file(name) else {
        return Ok(name.to_owned());
    };
    #[cfg(feature = "mujoco")]
    return super::mujoco::custom::digest(path);
    #[cfg(not(feature = "mujoco"))]
    return described(path, Randomization::Off).map(|_| String::new());
}

/// The files that a task depends on, each with its SHA-256: the description, the model, and every file that
/// the model is compiled from (included models, meshes, height fields, textures, skins); or the file of a series.
///
/// Names are relative to the folder of the description or the series, in order. A built-in task depends on no file.
///
/// # Errors
/// [`UnknownTask::BadFile`] where a file cannot be read, [`UnknownTask::NoSuchName`] where the name is none.
pub fn sources(name: &str) -> Result<Vec<(String, [u8; 32])>, UnknownTask> {
    if let Some(series) = CsvSeries::of(name) {
        return Ok(vec![series?.source()?]);
    }
    let Some(path) = description_file(name) else {
        return find(name).map(|_| Vec::new());
    };
    #[cfg(feature = "mujoco")]
    return super::mujoco::custom::sources(path);
    #[cfg(not(feature = "mujoco"))]
    return described(path, Randomization::Off).map(|_| Vec::new());
}

/// The name without its version.
fn bare(name: &str) -> &str {
    name.rsplit_once("-v").map_or(name, |(bare, _)| bare)
}

/// The name most like a misspelt one, full or bare as the misspelt one is.
fn nearest(name: &str) -> Option<&'static str> {
    /// Jaro-Winkler similarity, 0 to 1, below which a name is unlikely to be a misspelling of another.
    const LIKELY: f64 = 0.8;
    let lower = name.to_lowercase();
    let bare_names = TABLE
        .iter()
        .filter(|row| row.default)
        .map(|row| bare(row.name));
    let families = families::TABLE.iter();
    TABLE
        .iter()
        .map(|row| row.name)
        .chain(bare_names)
        .chain(families.flat_map(|family| [family.full, family.name]))
        .map(|known| (strsim::jaro_winkler(&lower, known), known))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity >= LIKELY)
        .map(|(_, known)| known)
}

/// Version of the MuJoCo library that is linked, or `none` in a build without it.
#[must_use]
pub fn simulator_version() -> String {
    #[cfg(feature = "mujoco")]
    return mujoco_rs::mujoco_version().to_string();
    #[cfg(not(feature = "mujoco"))]
    return "none".into();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{ActionSpace, Rng};
    use tpg_runtime::Action;

    /// One episode of fixed actions as bits, ends included.
    fn episode(task: &mut dyn Task, seed: u64) -> Vec<u64> {
        let inputs = task.spec().inputs.len();
        let mut observation = vec![0.0; inputs];
        let mut bits = Vec::new();
        task.reset(&mut Rng::new(seed));
        for t in 0..60u16 {
            let values = [f32::from(t % 7) / 3.0 - 1.0; 17];
            let action = match task.spec().actions {
                ActionSpace::Discrete(count) => Action::Discrete(t % count),
                ActionSpace::Continuous { len, .. } => {
                    Action::Continuous(&values[..usize::from(len)])
                }
            };
            task.observe(&mut observation);
            bits.extend(observation.iter().map(|x| u64::from(x.to_bits())));
            let step = task.step(action);
            bits.extend([step.reward.to_bits(), u64::from(step.terminated)]);
        }
        bits
    }

    #[test]
    fn a_reused_task_and_a_fresh_one_give_the_same_bits() {
        for name in names() {
            let mut used = create(name).unwrap();
            let first = episode(&mut *used, 1);
            episode(&mut *used, 2);
            assert_eq!(episode(&mut *used, 1), first, "{name} reused");
            assert_eq!(
                episode(&mut *create(name).unwrap(), 1),
                first,
                "{name} fresh"
            );
            assert_ne!(episode(&mut *used, 2), first, "{name} with another seed");
        }
    }

    #[test]
    fn names_and_specs_agree() {
        for name in names() {
            assert_eq!(create(name).unwrap().spec().name, *name);
        }
        assert_eq!(create("cartpole").unwrap().spec().name, "cartpole-v1");
    }

    #[test]
    fn a_family_takes_its_parameter_from_the_name() {
        for (name, full) in [
            ("tmaze", "tmaze:10-v1"),
            ("tmaze-v1", "tmaze:10-v1"),
            ("tmaze:100", "tmaze:100-v1"),
            ("tmaze:100-v1", "tmaze:100-v1"),
            ("repeat-previous", "repeat-previous:easy-v1"),
            ("repeat-previous:hard", "repeat-previous:hard-v1"),
            ("repeat-previous:2", "repeat-previous:2-v1"),
            ("memory-size:4", "memory-size:4-v1"),
        ] {
            assert_eq!(create(name).unwrap().spec().name, full, "{name}");
        }
        for (name, says) in [
            ("tmaze:0", "tmaze:NUMBER, from 1 to 100000"),
            ("tmaze:", "tmaze has no task \"\""),
            ("tmaze:+5", "no task \"+5\""),
            ("tmaze:010", "no task \"010\""),
            (
                "repeat-first:3",
                "repeat-first:easy, repeat-first:medium or repeat-first:hard",
            ),
            (
                "repeat-previous:51",
                "or repeat-previous:NUMBER, from 0 to 50",
            ),
            ("tmaze:100-v2", "no task \"100-v2\""),
            ("tmase:100", "did you mean \"tmaze:10-v1\""),
        ] {
            let error = create(name).err().unwrap().to_string();
            assert!(error.contains(says), "{name}: {error}");
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_and_suggests_the_nearest() {
        let message = |name: &str| create(name).err().unwrap().to_string();
        let text = message("carpole-v1");
        assert!(text.starts_with(
            "no task is called \"carpole-v1\", did you mean \"cartpole-v1\"?; tasks: cartpole-v1"
        ));
        assert!(message("Cart-Pole").contains("did you mean \"cartpole\""));
        assert!(message("hoper").contains("did you mean \"hopper\""));
        assert!(!message("zzz").contains("did you mean"));
    }

    #[cfg(not(feature = "mujoco"))]
    #[test]
    fn a_build_without_mujoco_says_so() {
        let error = create("hopper").err().unwrap().to_string();
        assert!(
            error.starts_with("the task hopper-v4 needs MuJoCo"),
            "{error}"
        );
        assert!(error.contains("feature `mujoco`"), "{error}");
        assert_eq!(
            names()[..4],
            ["cartpole-v1", "acrobot-v1", "pendulum-v1", "tmaze:10-v1"]
        );
    }
}
