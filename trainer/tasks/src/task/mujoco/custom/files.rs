//! The files that a described task is made of.

use super::description::Description;
use super::keys::like;
use crate::task::UnknownTask;
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Hash over the file that describes a task, those that it is like, and its model's file; the same wherever they lie.
pub(in crate::task) fn digest(path: &Path) -> Result<String, UnknownTask> {
    let (_, model_path) = read(path)?;
    let mut hasher = Sha256::new();
    for file in descriptions(path)?.iter().chain([&model_path]) {
        let bytes = load(file)?;
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    Ok(hasher
        .finalize()
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect())
}

/// Every file that the task depends on, with its SHA-256: the description, the model, what the model includes, meshes,
/// height fields, textures and skins.
///
/// Names are relative to the folder of the description, in order. A file that the model merely mentions where MuJoCo
/// would look for one counts too; a mention without a file does not.
pub(in crate::task) fn sources(path: &Path) -> Result<Vec<(String, [u8; 32])>, UnknownTask> {
    let (_, model_path) = read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut found = BTreeMap::new();
    for file in descriptions(path)? {
        add(&mut found, folder, &file, &load(&file)?);
    }
    follow(&mut found, folder, &model_path)?;
    Ok(found.into_iter().collect())
}

/// Reads a description; its model lies beside it.
pub(super) fn read(path: &Path) -> Result<(Description, PathBuf), UnknownTask> {
    let text = fs::read_to_string(path).map_err(|error| unreadable(path, &error))?;
    let load = |name: &str| {
        let path = path.with_file_name(name);
        fs::read_to_string(&path).map_err(|error| format!("cannot be read: {error}"))
    };
    let description = Description::read(&text, &load).map_err(|why| UnknownTask::BadFile {
        path: path.to_owned(),
        why,
    })?;
    let model_path = path.with_file_name(&description.model);
    // MuJoCo reads the file itself, but says less when it cannot.
    fs::File::open(&model_path).map_err(|error| unreadable(&model_path, &error))?;
    Ok((description, model_path))
}

fn unreadable(path: &Path, error: &std::io::Error) -> UnknownTask {
    UnknownTask::BadFile {
        path: path.to_owned(),
        why: format!("cannot be read: {error}"),
    }
}

/// A description and those that it is like, in order.
fn descriptions(path: &Path) -> Result<Vec<PathBuf>, UnknownTask> {
    let mut files = vec![path.to_owned()];
    while let Some(last) = files.last() {
        let text = String::from_utf8_lossy(&load(last)?).into_owned();
        let bad = |why| UnknownTask::BadFile {
            path: last.clone(),
            why,
        };
        match like(&text).map_err(bad)? {
            Some(name) => files.push(path.with_file_name(name)),
            None => break,
        }
    }
    Ok(files)
}

fn load(path: &Path) -> Result<Vec<u8>, UnknownTask> {
    fs::read(path).map_err(|error| unreadable(path, &error))
}

/// Adds a file under its name in the folder.
fn add(found: &mut BTreeMap<String, [u8; 32]>, folder: &Path, path: &Path, bytes: &[u8]) {
    let name = path.strip_prefix(folder).unwrap_or(path);
    let name = name.to_string_lossy().replace('\\', "/");
    found.insert(name, Sha256::digest(bytes).into());
}

/// Adds a model's file and all that it mentions, through the models that it includes.
fn follow(
    found: &mut BTreeMap<String, [u8; 32]>,
    folder: &Path,
    model: &Path,
) -> Result<(), UnknownTask> {
    let home = model.parent().unwrap_or(Path::new(""));
    // Texts of the XML files so far; the list grows while it is read.
    let mut texts = vec![(home.to_owned(), load(model)?)];
    add(found, folder, model, &texts[0].1);
    let mut seen = BTreeSet::from([model.to_owned()]);
    let mut folders = vec![home.to_owned()];
    let mut mentions: Vec<(PathBuf, String)> = Vec::new();
    let mut next = 0;
    while next < texts.len() {
        let (at, bytes) = &texts[next];
        let (at, text) = (at.clone(), String::from_utf8_lossy(bytes).into_owned());
        next += 1;
        for (name, value) in attributes(&text) {
            if is_nan(name, value) {
                return Err(UnknownTask::BadFile {
                    path: model.to_owned(),
                    why: format!(
                        "{name}={value:?} in it, or in a file that it includes: give a finite number; MuJoCo reads nan as \
                         \"not said\""
                    ),
                });
            }
            if ["meshdir", "texturedir", "assetdir"].contains(&name) {
                folders.push(home.join(value));
                folders.push(at.join(value));
            } else if name.starts_with("file") {
                mentions.push((at.clone(), value.to_owned()));
            }
        }
        // A compiler's folder may stand in a file that is included later, so all mentions are tried again.
        for (at, value) in &mentions {
            for path in candidates(at, &folders, value) {
                if !path.is_file() || !seen.insert(path.clone()) {
                    continue;
                }
                let bytes = load(&path)?;
                add(found, folder, &path, &bytes);
                if path
                    .extension()
                    .is_some_and(|end| end.eq_ignore_ascii_case("xml"))
                {
                    let at = path.parent().unwrap_or(Path::new("")).to_owned();
                    texts.push((at, bytes));
                }
            }
        }
    }
    Ok(())
}

/// Where MuJoCo may look for a file: beside the file that mentions it and in the compiler's folders, with its folder or
/// without (`strippath`).
fn candidates(at: &Path, folders: &[PathBuf], value: &str) -> Vec<PathBuf> {
    let bare = Path::new(value).file_name().unwrap_or(OsStr::new(""));
    let homes = folders.iter().map(PathBuf::as_path).chain([at]);
    homes
        .flat_map(|home| [home.join(value), home.join(bare)])
        .collect()
}

/// Whether an attribute says `nan` where a number is meant.
fn is_nan(name: &str, value: &str) -> bool {
    const WORDS: [&str; 9] = [
        "name",
        "class",
        "childclass",
        "file",
        "joint",
        "body",
        "site",
        "geom",
        "mesh",
    ];
    let mut words = value.split_ascii_whitespace();
    !WORDS.contains(&name) && words.any(|word| word.eq_ignore_ascii_case("nan"))
}

/// The attributes of an XML text, in order; those of comments too.
///
/// MuJoCo reads files that a strict parser refuses, so this looks for names, equals signs and quotes alone.
fn attributes(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        loop {
            let (before, after) = rest.split_once('=')?;
            rest = after;
            let name = before.trim_end();
            let start = name
                .rfind(|c: char| c.is_whitespace() || c == '<')
                .map_or(0, |at| at + 1);
            let name = name.get(start..).unwrap_or_default();
            let value = after.trim_start();
            let Some(quote) = value.chars().next().filter(|c| ['"', '\''].contains(c)) else {
                continue;
            };
            let (value, after) = value[1..].split_once(quote)?;
            rest = after;
            return Some((name, value));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_found_as_mujoco_reads_them() {
        let text = "<a file = 'x=\"1\"' n=\"\"/><!-- y=\"2\" --> <b\nfile=\"z\"/> = ";
        let found: Vec<_> = attributes(text).collect();
        assert_eq!(
            found,
            [("file", "x=\"1\""), ("n", ""), ("y", "2"), ("file", "z")]
        );
    }

    #[test]
    fn every_file_that_the_model_is_compiled_from_counts() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        put(
            "task.toml",
            include_str!("../../../../../../docs/examples/crane/crane.toml"),
        );
        put(
            "crane.xml",
            "<mujoco><include file='parts/body.xml'/><texture fileright=\"r.png\"/></mujoco>",
        );
        put(
            "parts/body.xml",
            "<mujoco><compiler meshdir=\"cad\"/><mesh file=\"old/a.stl\"/></mujoco>",
        );
        put("cad/a.stl", "mesh");
        put("cad/unused.stl", "mesh");
        put("r.png", "picture");
        let names =
            || -> Vec<(String, [u8; 32])> { sources(&folder.path().join("task.toml")).unwrap() };
        let before = names();
        let listed: Vec<&str> = before.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(
            listed,
            [
                "cad/a.stl",
                "crane.xml",
                "parts/body.xml",
                "r.png",
                "task.toml"
            ]
        );
        put("cad/a.stl", "another mesh");
        let after = names();
        let changed: Vec<&str> = (before.iter().zip(&after))
            .filter(|(a, b)| a.1 != b.1)
            .map(|(a, _)| a.0.as_str())
            .collect();
        assert_eq!(changed, ["cad/a.stl"]);
    }
}
