//! What the command says of itself: configurations, completions, manual pages, help.

use std::fs;
use std::process::Command;

use tpg_tests::process::{stderr, text, tpg, tpg_ok};

fn printed(words: &[&str]) -> String {
    String::from_utf8(tpg_ok(words).stdout).expect("text")
}

#[test]
fn a_configuration_that_was_printed_trains_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let small = ["--set", "evolution.population=11"];
    let config = printed(&[&["config", "cartpole-sr-sm"], &small[..]].concat());
    assert!(
        config.contains("\n# Default: 1500\npopulation = 11\n"),
        "{config}"
    );
    let file = path("mine.toml");
    fs::write(&file, &config).expect("written");
    let (first, second) = (path("first"), path("second"));
    let train = |preset, more: &[&str], out| {
        let words = ["train", preset, "--generations", "1", "--out", text(out)];
        tpg_ok(&[&words[..], more].concat());
        fs::read_to_string(out.join("config.toml")).expect("a configuration")
    };
    let wanted = train("cartpole-sr-sm", &small, &first);
    let got = train("hopper-sl", &["--config", text(&file)], &second);
    assert_eq!(got, wanted);
    for (words, status, word) in [
        (["config", "cartpol-sr"], 2, "cartpole-sr"),
        (["config", "--config=missing.toml"], 2, "PRESET"),
    ] {
        let output = tpg(words);
        assert_eq!(output.status.code(), Some(status), "{}", stderr(&output));
        assert!(stderr(&output).contains(word), "{}", stderr(&output));
    }
    let output = tpg(["config", "sr", "--config", "missing.toml"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

#[test]
fn every_shell_gets_its_completions() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = printed(&["completions", shell]);
        for word in ["tensorboard", "disassemble", "experiment"] {
            assert!(script.contains(word), "{shell}: no {word}");
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("tpg.bash");
    fs::write(&file, printed(&["completions", "bash"])).expect("written");
    // What bash would offer behind `tpg tr`.
    let script = format!(
        "source {} && COMP_WORDS=(tpg tr) COMP_CWORD=1 && _tpg tpg tr tpg && echo ${{COMPREPLY[@]}}",
        text(&file)
    );
    let output = Command::new("bash").args(["-c", &script]).output();
    let output = output.expect("bash runs");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "train");
    assert_eq!(tpg(["completions", "csh"]).status.code(), Some(2));
}

#[test]
fn there_is_a_manual_page_for_each_verb() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("share/man1");
    tpg_ok(&["man", text(&out)]);
    let help = printed(&["--help"]);
    let (_, verbs) = help.split_once("Commands:").expect("a list");
    let (verbs, _) = verbs.split_once("Options:").expect("its end");
    let verbs = verbs
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let verbs: Vec<&str> = verbs
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(verbs.len() > 12, "{verbs:?}");
    for verb in verbs.into_iter().filter(|verb| *verb != "help") {
        let page = out.join(format!("tpg-{verb}.1"));
        let page = fs::read_to_string(&page).unwrap_or_else(|_| panic!("no page of {verb}"));
        assert!(page.contains(".SH SYNOPSIS"), "{page}");
    }
    let page = fs::read_to_string(out.join("tpg-train.1")).expect("a page");
    assert!(page.contains("tensorboard"), "{page}");
}

#[test]
fn help_names_the_seed_and_the_budget_that_are_not_given() {
    let help = printed(&["train", "--help"]);
    let words: Vec<&str> = help.split_whitespace().collect();
    let help = words.join(" ");
    for words in [
        "Seed of the run, by default 0",
        "100 where no budget is named",
    ] {
        assert!(help.contains(words), "{help}");
    }
}
