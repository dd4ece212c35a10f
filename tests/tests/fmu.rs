//! Policies as co-simulation units of FMI 3.0: FMPy, an importer of others, finds their descriptions valid and gets the
//! bits of `tpg eval`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tpg_tests::process::{command_path, stderr, text, tpg, tpg_ok};
use tpg_tests::{firmware, golden};

/// A Python with FMPy in a virtual environment of its own. None if it cannot be made.
fn python() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmpy");
    let python = folder.join("bin/python");
    let pins = firmware::repository().join("tests/tests/fmu/requirements.txt");
    let wanted = fs::read_to_string(&pins).expect("a list of packages");
    let installed = folder.join("requirements.txt");
    if fs::read_to_string(&installed).is_ok_and(|found| found == wanted) {
        return Some(python);
    }
    let mut make = Command::new("python3");
    make.args(["-m", "venv"]).arg(&folder);
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--no-deps"]);
    install
        .arg("--disable-pip-version-check")
        .arg("-r")
        .arg(&pins);
    for mut command in [make, install] {
        if !command.status().is_ok_and(|status| status.success()) {
            firmware::skip(
                "co-simulation units",
                "FMPy cannot be installed: it takes python3 with venv, and PyPI",
            );
            return None;
        }
    }
    fs::write(installed, wanted).expect("a note of what is installed");
    Some(python)
}

/// Discrete and continuous actions, a front end with missing values, transcendental functions.
fn policies() -> Vec<PathBuf> {
    let champions = firmware::repository().join("docs/champions");
    let mut names = vec!["cartpole", "pendulum"];
    if cfg!(feature = "mujoco") {
        names.push("hopper-b23");
    }
    let champions = names
        .into_iter()
        .map(|name| champions.join(format!("{name}.tpg")));
    champions
        .chain([golden::path("champions/pendulum-per-episode.tpg")])
        .collect()
}

#[test]
fn fmpy_finds_units_valid_and_gets_the_bits_of_eval() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let script = firmware::repository().join("tests/tests/fmu/check.py");
    let mut check = Command::new(python);
    check.arg("-B").arg(script);
    for policy in policies() {
        let name = policy.file_stem().expect("a name").display().to_string();
        let unit = folder
            .path()
            .join(name.replace('-', "_"))
            .with_extension("fmu");
        let trace = unit.with_extension("trace");
        tpg_ok(&["export", text(&policy), "--fmu", text(&unit)]);
        tpg_ok(&[
            "eval",
            text(&policy),
            "--episodes",
            "1",
            "--trace",
            text(&trace),
        ]);
        check.args([&unit, &trace]);
    }
    let output = check.output().expect("Python runs");
    assert!(output.status.success(), "{}", stderr(&output));
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(said.matches("decisions agree").count(), policies().len());
}

/// The bounds of variables are in the description, and what they are before they are set lies within.
#[test]
fn a_unit_says_the_ranges_of_its_variables() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let unit = folder.path().join("ranges.fmu");
    tpg_ok(&[
        "export",
        text(&golden::path("v3/each-ranges.tpg")),
        "--fmu",
        text(&unit),
    ]);
    let script = "import sys, fmpy, fmpy.validation as v\n\
        print(v.validate_fmu(sys.argv[1]))\n\
        for x in fmpy.read_model_description(sys.argv[1]).modelVariables: print(x.causality, x.min, x.max, x.start)";
    let mut read = Command::new(python);
    let output = read
        .args(["-c", script, text(&unit)])
        .output()
        .expect("Python runs");
    let said = String::from_utf8_lossy(&output.stdout);
    let lines: Vec<&str> = said.lines().collect();
    let wanted = [
        "[]",
        "independent None None None",
        "input None None 0",
        "input 0 None 0",
        "input -2.5 3 0",
        "input None 7 0",
        "input None None 0",
        "output -1 0.25 0",
        "output -0.125 1 0",
        "parameter None None 0",
    ];
    assert_eq!(lines, wanted, "{}", stderr(&output));
}

/// What the sources of a unit hold compiles elsewhere, without a warning.
#[test]
fn sources_of_a_unit_compile_without_a_warning() {
    use tpg_runtime::Policy;
    for policy in policies() {
        let bytes = fs::read(&policy).expect("a policy");
        let policy = Policy::load(&bytes).expect("valid");
        let unit = tpg_tools::export::Fmu::new(&policy, "champion", "a test");
        let folder = tempfile::tempdir().expect("a folder");
        let mut files = Vec::new();
        for (name, content) in unit.sources() {
            fs::write(folder.path().join(name), content).expect("written");
            files.extend(name.ends_with(".c").then_some(name.to_owned()));
        }
        assert_eq!(files, ["champion.c", "fmi3.c"]);
        for compiler in ["cc", "clang"] {
            if !firmware::runs(compiler, &["--version"]) {
                firmware::skip(
                    "a unit's sources",
                    "clang is missing: apt-get install clang",
                );
                continue;
            }
            let mut cc = Command::new(compiler);
            cc.current_dir(folder.path()).args([
                "-std=c99",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-Wpedantic",
                "-Wconversion",
                "-Wshadow",
                "-ffp-contract=off",
                "-fsyntax-only",
                "-DFMI3_FUNCTION_PREFIX=champion_",
            ]);
            let output = cc.args(&files).output().expect("a compiler");
            assert!(output.status.success(), "{}", stderr(&output));
        }
    }
}

#[test]
fn a_unit_needs_a_name_and_a_compiler() {
    let policy = golden::path("v1/classic.tpg");
    let folder = tempfile::tempdir().expect("a folder");
    let unit = folder.path().join("classic.fmu");
    for (compiler, says) in [
        ("no-such-compiler", "install a C compiler"),
        ("false", "false does not compile the unit's library"),
    ] {
        let mut export = Command::new(command_path("tpg"));
        export.args(["export", text(&policy), "--fmu", text(&unit)]);
        let output = export.env("CC", compiler).output().expect("tpg runs");
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert!(!unit.exists());
    }
    for name in ["while.fmu", "classic.zip", "1st.fmu"] {
        let output = tpg(["export", text(&policy), "--fmu", name]);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("champion.fmu"));
    }
}
