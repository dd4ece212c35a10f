//! The documents: the commands that they show exist, and the pages that people read from top to bottom have short sentences.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use tpg_tests::process::{text, tpg};

/// Most words of a sentence.
const LONGEST: usize = 30;
/// Pages of definitions, formulas and one-line records, in which a sentence may be longer.
const LONG: [&str; 4] = ["format.md", "semantics.md", "decisions.md", "CHANGELOG.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a parent")
        .to_owned()
}

/// README files and all pages of the book, by name.
fn pages() -> BTreeMap<String, String> {
    let root = root();
    let mut paths: Vec<PathBuf> = [
        "README.md",
        "CONTRIBUTING.md",
        "firmware-examples/README.md",
    ]
    .iter()
    .map(|name| root.join(name))
    .collect();
    let docs = fs::read_dir(root.join("docs")).expect("a folder of documents");
    paths.extend(docs.map(|entry| entry.expect("an entry").path()));
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    let page = |path: PathBuf| {
        let name = path.strip_prefix(&root).expect("inside").to_owned();
        (
            text(&name).to_owned(),
            fs::read_to_string(&path).expect("readable"),
        )
    };
    paths.into_iter().map(page).collect()
}

/// Blocks of code, each without its first line, and everything else.
fn split(page: &str) -> (Vec<String>, String) {
    let (mut blocks, mut rest) = (Vec::new(), String::new());
    for (k, part) in page.split("```").enumerate() {
        if k % 2 == 1 {
            blocks.push(
                part.split_once('\n')
                    .map_or(String::new(), |(_, code)| code.to_owned()),
            );
        } else {
            rest.push_str(part);
            rest.push_str("\n\n");
        }
    }
    (blocks, rest)
}

/// Commands of `tpg` in a text: the words behind its name, up to the end of the command.
fn commands(code: &str) -> Vec<Vec<String>> {
    let code = code.replace("\\\n", " ");
    let mut commands = Vec::new();
    for line in code.lines() {
        let line = line.split(" #").next().unwrap_or_default();
        for command in line.split(['|', ';', '&', '`', '(', ')']) {
            let mut words = command.split_whitespace();
            // A script may take the program as an argument.
            let is_script = command.trim_start().starts_with("scripts/");
            if !is_script
                && words
                    .by_ref()
                    .any(|word| ["tpg", "$tpg", "target/release/tpg"].contains(&word))
            {
                commands.push(words.map(|word| word.replace(['\'', '"'], "")).collect());
            }
        }
    }
    commands.retain(|words: &Vec<String>| {
        words
            .first()
            .is_some_and(|word| word.starts_with(char::is_lowercase))
    });
    commands
}

/// Inline code.
fn inline(rest: &str) -> Vec<String> {
    rest.replace('\n', " ")
        .split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

/// The verb of a command with its own verb, if it has one, and its flags.
fn verb_and_flags(words: &[String]) -> (Vec<&str>, BTreeSet<&str>) {
    let verbs = if words[0] == "experiment" { 2 } else { 1 };
    let verb = words.iter().take(verbs).map(String::as_str).collect();
    let flags = words
        .iter()
        .filter(|word| word.starts_with("--") && word.len() > 2)
        .map(|word| word.split('=').next().unwrap_or_default())
        .map(|word| word.trim_end_matches([',', '.', ':']))
        .collect();
    (verb, flags)
}

#[test]
fn commands_in_documents_exist() {
    let mut help: BTreeMap<Vec<String>, String> = BTreeMap::new();
    let (mut checked, mut faults) = (0, Vec::new());
    for (name, page) in pages() {
        let (mut code, rest) = split(&page);
        code.extend(inline(&rest));
        for words in code.iter().flat_map(|code| commands(code)) {
            let (verb, flags) = verb_and_flags(&words);
            let key: Vec<String> = verb.iter().map(|&word| word.to_owned()).collect();
            let help = help.entry(key).or_insert_with(|| {
                let output = tpg(verb.iter().copied().chain(["--help"]));
                if output.status.success() {
                    String::from_utf8(output.stdout).expect("text")
                } else {
                    String::new()
                }
            });
            checked += 1;
            if help.is_empty() {
                faults.push(format!("{name}: no command `tpg {}`", verb.join(" ")));
            }
            let known = |flag: &str| {
                help.split(|letter: char| !letter.is_alphanumeric() && letter != '-')
                    .any(|word| word == flag)
            };
            for flag in flags.iter().filter(|flag| !known(flag)) {
                faults.push(format!("{name}: `tpg {}` has no {flag}", verb.join(" ")));
            }
        }
    }
    println!("{checked} commands");
    assert!(checked > 50, "only {checked} commands were found");
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Scripts and make targets in a text.
fn scripts_and_targets(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for line in code.lines() {
        let bare = |word| str::trim_matches(word, ['@', '"', '\'', '(', ')', ',', '.', ';']);
        let words: Vec<&str> = line.split_whitespace().map(bare).collect();
        let scripts = words.iter().filter(|word| word.starts_with("scripts/"));
        let scripts = scripts.filter(|word| word.len() > "scripts/".len());
        found.extend(scripts.map(|word| (*word).to_owned()));
        let targets = words.windows(2).filter(|pair| pair[0] == "make");
        let targets = targets.filter(|pair| pair[1].starts_with(char::is_alphabetic));
        found.extend(targets.map(|pair| format!("make {}", pair[1])));
    }
    found
}

/// Scripts and make targets that continuous integration runs, its tests included.
fn run_by_ci() -> BTreeSet<String> {
    let root = root();
    let read = |path: PathBuf| fs::read_to_string(path).unwrap_or_default();
    let makefile = read(root.join("Makefile"));
    let mut texts = vec![read(root.join(".ci/run"))];
    for folder in [
        "tests/tests",
        "tests/tests/reliability",
        "tests/src",
        "sim-bridge/tests",
    ] {
        let files = fs::read_dir(root.join(folder)).expect("a folder of tests");
        texts.extend(files.map(|file| read(file.expect("an entry").path())));
    }
    let mut run = BTreeSet::new();
    while let Some(text) = texts.pop() {
        // Tests name scripts by a path from elsewhere.
        let text = text.replace("../scripts/", " scripts/").replace('"', " ");
        for name in scripts_and_targets(&text) {
            if run.insert(name.clone()) {
                texts.push(match name.strip_prefix("make ") {
                    Some(target) => makefile
                        .split("\n\n")
                        .find(|rule| {
                            rule.lines()
                                .any(|line| line.starts_with(&format!("{target}:")))
                        })
                        .map_or(String::new(), str::to_owned),
                    None => read(root.join(&name)),
                });
            }
        }
    }
    run
}

/// Prints which of the scripts and make targets in the documents continuous integration runs.
#[test]
fn scripts_in_documents_exist() {
    let makefile = fs::read_to_string(root().join("Makefile")).expect("a Makefile");
    let (run, mut named) = (run_by_ci(), BTreeSet::new());
    for page in pages().values() {
        let (mut code, rest) = split(page);
        code.extend(inline(&rest));
        for code in code {
            named.extend(scripts_and_targets(&code));
        }
    }
    for name in &named {
        let exists = match name.strip_prefix("make ") {
            Some(target) => makefile.contains(&format!("\n{target}:")),
            None => root().join(name).exists(),
        };
        assert!(exists, "there is no {name}");
        let who = if run.contains(name) {
            "run by CI"
        } else {
            "by hand"
        };
        println!("{who:9} {name}");
    }
    assert!(
        run.contains("scripts/setup") && named.len() > 10,
        "{run:?}, {named:?}"
    );
}

/// Sentences of a page as numbers of words and texts. Tables, headings and code do not count, inline code is one word.
fn sentences(rest: &str) -> Vec<(usize, String)> {
    let mut paragraphs = vec![String::new()];
    for line in rest.lines() {
        let trimmed = line.trim_start();
        let item = trimmed.starts_with("- ")
            || trimmed
                .split_once(". ")
                .is_some_and(|(number, _)| number.parse::<u32>().is_ok());
        if trimmed.is_empty() || item || line.starts_with("    ") && !trimmed.starts_with("- ") {
            paragraphs.push(String::new());
        }
        // Formulas are indented by four; what continues a list is indented less.
        if trimmed.starts_with(['|', '#', '<', '!', '>']) || line.starts_with("    ") {
            continue;
        }
        let last = paragraphs.last_mut().expect("one at least");
        last.push_str(trimmed);
        last.push(' ');
    }
    let mut sentences = Vec::new();
    for paragraph in paragraphs {
        let mut plain = String::new();
        for (k, part) in paragraph.split('`').enumerate() {
            plain.push_str(if k % 2 == 1 { "code" } else { part });
        }
        let mut sentence: Vec<&str> = Vec::new();
        for word in plain.split_whitespace() {
            sentence.push(word);
            let end = word.trim_end_matches([')', '*', '"', ']']);
            if end.ends_with(['.', '!', '?', ':', ';']) {
                sentences.push((sentence.len(), sentence.join(" ")));
                sentence.clear();
            }
        }
        sentences.push((sentence.len(), sentence.join(" ")));
    }
    sentences
}

#[test]
fn sentences_are_short() {
    let (mut lengths, mut faults) = (Vec::new(), Vec::new());
    for (name, page) in pages() {
        let (_, rest) = split(&page);
        let found = sentences(&rest);
        lengths.extend(
            found
                .iter()
                .map(|(words, _)| *words)
                .filter(|words| *words > 0),
        );
        if LONG.iter().any(|long| name.ends_with(long)) {
            continue;
        }
        let long = found.iter().filter(|(words, _)| *words > LONGEST);
        faults.extend(long.map(|(words, sentence)| format!("{name}: {words} words: {sentence}")));
    }
    lengths.sort_unstable();
    let at = |share: usize| lengths[lengths.len() * share / 100];
    println!(
        "{} sentences: median {}, 90th percentile {}, 99th {}",
        lengths.len(),
        at(50),
        at(90),
        at(99)
    );
    assert!(faults.is_empty(), "{faults:#?}");
}
