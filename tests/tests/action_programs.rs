//! Policies whose outputs each have programs of their own: what they decide, what is refused, how they are trained.

use tpg_runtime::blob::ActionKind;
use tpg_runtime::parts::Field;
use tpg_runtime::tables::{ProgramId, Target, TeamId};
use tpg_runtime::trace::Observer;
use tpg_runtime::{Action, Policy, VerifyError};
use tpg_tests::draft::{Draft, DraftProgram, DraftTeam, TestAgent, header};
use tpg_tests::process::{stderr, text, tpg};

/// Output, bid and value of each program of the table in `docs/semantics.md`.
const PROGRAMS: [(u16, f32, f32); 6] = [
    (0, 1.0, 1.25),
    (1, -3.0, 9.0),
    (0, 2.0, -0.75),
    (0, 2.0, 1.0),
    (2, -0.0, 0.5),
    (2, 0.0, 1.5),
];

/// One team of these programs, three outputs within [−0.5, 2].
fn draft(programs: &[(u16, f32, f32)]) -> Draft {
    let mut header = header(3, 2);
    header.action_kind = ActionKind::Each;
    header.actions = 3;
    (header.action_low, header.action_high) = (-0.5, 2.0);
    let mut draft = Draft {
        header,
        teams: vec![DraftTeam {
            members: (0..programs.len() as u16).collect(),
            ..DraftTeam::default()
        }],
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    for (number, (output, bid, value)) in programs.iter().enumerate() {
        let mut program = DraftProgram::bidding(*bid, Target::Atomic(*output));
        program.constants[1] = *value;
        draft.programs.push(program);
        draft.programs[number].output = Some(draft.scalar(number, 1));
    }
    draft
}

/// What gave each output.
#[derive(Default)]
struct Given(Vec<(u16, u16)>);

impl Observer for Given {
    fn give(&mut self, ProgramId(program): ProgramId, output: u16) {
        self.0.push((output, program));
    }
}

/// The action, the program that bid most, and for each output the program that gave it.
fn decide(draft: &Draft) -> (Vec<f32>, u16, Vec<(u16, u16)>) {
    let bytes = draft.encode();
    let policy = Policy::load(&bytes).expect("a policy");
    let mut agent = TestAgent::new(policy).expect("enough room");
    let mut given = Given::default();
    let decision = agent
        .decide_traced(&[0.0; 2], &mut given)
        .expect("two elements");
    let Action::Continuous(values) = decision.action else {
        panic!("{:?}", decision.action);
    };
    given.0.sort_unstable();
    (values.to_vec(), decision.winner.0, given.0)
}

#[test]
fn each_output_is_the_clamped_value_of_its_highest_bidder() {
    let (action, winner, given) = decide(&draft(&PROGRAMS));
    assert_eq!(action, [-0.5, 2.0, 0.5]);
    assert_eq!(winner, 2, "the first of the highest bidders of all");
    assert_eq!(given, [(0, 2), (1, 1), (2, 4)]);
}

#[test]
fn of_equal_bids_the_earlier_member_wins_whatever_its_number() {
    let mut draft = draft(&PROGRAMS);
    draft.teams[0].members = vec![5, 3, 1, 4, 2, 0];
    let (action, winner, given) = decide(&draft);
    assert_eq!(action, [1.0, 2.0, 1.5]);
    assert_eq!(winner, 3);
    assert_eq!(given, [(0, 3), (1, 1), (2, 5)]);
}

#[test]
fn the_lowest_bid_that_there_is_wins_where_it_is_alone() {
    let lowest = [
        (0, f32::MIN, 1.0),
        (1, f32::MIN, 0.25),
        (2, f32::MAX, -0.25),
    ];
    let (action, ..) = decide(&draft(&lowest));
    assert_eq!(action, [1.0, 0.25, -0.25]);
}

#[test]
fn a_program_outside_the_team_gives_nothing() {
    let mut all = PROGRAMS.to_vec();
    all.push((1, 100.0, 0.0));
    let mut draft = draft(&all);
    draft.teams[0].members.pop();
    assert_eq!(decide(&draft).0, [-0.5, 2.0, 0.5]);
}

/// An agent that the compiler sized decides as one with room to spare.
#[test]
fn an_agent_of_exactly_the_policys_size_decides_alike() {
    tpg_runtime::policy!(mod champion = include_bytes!("../golden/v1/each.tpg"));
    let policy = Policy::load(champion::BYTES).expect("a policy");
    let mut state = champion::State::new();
    let mut exact = champion::load(&mut state).expect("room");
    let mut large = TestAgent::new(policy).expect("room");
    for step in 0..20u8 {
        let observation = [0.5, -1.0, 2.0, 0.25].map(|x: f32| x * f32::from(step));
        let decision = exact.decide(&observation);
        assert_eq!(Ok(decision), large.decide(&observation));
    }
}

#[test]
fn policies_that_lack_a_part_are_refused() {
    type Change = fn(&mut Draft);
    let header = |field, needed, got| VerifyError::Header { field, needed, got };
    let cases: [(Change, VerifyError); 8] = [
        (
            |d| d.programs[1].target = Target::Atomic(2),
            VerifyError::NoProgramFor { output: 1 },
        ),
        (
            |d| d.teams[0].members.retain(|m| *m < 4),
            VerifyError::NoProgramFor { output: 2 },
        ),
        (
            |d| d.programs[3].target = Target::Team(TeamId(0)),
            VerifyError::LeadsToTeam { program: 3 },
        ),
        (
            |d| d.programs[0].target = Target::Atomic(3),
            VerifyError::NoSuchTarget { program: 0 },
        ),
        // The register of another program, and a vector where a scalar belongs.
        (
            |d| d.programs[2].output = d.programs[1].output,
            VerifyError::NoSuchTarget { program: 2 },
        ),
        (
            |d| d.teams.push(d.teams[0].clone()),
            header(Field::Teams, 1, 2),
        ),
        (
            |d| d.header.actions = 4,
            VerifyError::NoProgramFor { output: 3 },
        ),
        (|d| d.header.actions = 257, header(Field::Actions, 256, 257)),
    ];
    for (number, (change, expected)) in cases.into_iter().enumerate() {
        let mut draft = draft(&PROGRAMS);
        change(&mut draft);
        let error = Policy::load(&draft.encode()).expect_err("a fault");
        assert_eq!(error, expected, "case {number}");
        assert!(!error.to_string().is_empty());
    }
    let mut one = draft(&[(0, 0.0, 1.0)]);
    one.header.actions = 1;
    one.programs[0].output = Some(one.scalar(0, 1));
    let error = Policy::load(&one.encode()).expect_err("one output");
    assert_eq!(error, header(Field::Actions, 2, 1));
}

#[test]
fn the_setting_is_for_tasks_with_several_continuous_outputs() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    for (preset, setting, says) in [
        (
            "cartpole-sl",
            "policy.action-programs=each",
            "continuous outputs",
        ),
        (
            "pendulum-sl",
            "policy.action-programs=each",
            "continuous outputs",
        ),
        (
            "pendulum-sl",
            "policy.action-programs=eahc",
            "did you mean \"each\"",
        ),
    ] {
        let output = tpg(["train", preset, "--set", setting, "--out", text(&out)]);
        assert_eq!(output.status.code(), Some(2), "{preset} {setting}");
        let said = stderr(&output);
        assert!(
            said.contains("policy.action-programs") && said.contains(says),
            "{said}"
        );
    }
}

#[cfg(feature = "mujoco")]
mod trained {
    use std::path::{Path, PathBuf};

    use tpg_runtime::tables::Program;
    use tpg_tests::process::{tpg_json, tpg_ok};

    use super::*;

    fn train(preset: &str, threads: &str, settings: &[&str], out: &Path) -> PathBuf {
        let mut arguments = vec!["train", preset, "--seed", "3", "--generations", "4"];
        arguments.extend(["--threads", threads, "--out", text(out)]);
        arguments.extend(["--set", "policy.action-programs=each"]);
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        tpg_ok(&arguments);
        out.join("champion.tpg")
    }

    const EVOLVED: [&str; 4] = [
        "evolution.population=20",
        "evolution.children=20",
        "evaluation.episodes=2",
        "evolution.team.grow=0.2",
    ];
    /// One tuned line that begins linear and grows by two programs.
    const TUNED: [&str; 7] = [
        "tuning.iterations=3",
        "tuning.directions=4",
        "tuning.top=2",
        "tuning.grow-after=3",
        "tuning.grow-to=5",
        "front-end.refit-every=1",
        "selection.candidates=0",
    ];

    fn targets(policy: &Policy<'_>) -> Vec<u16> {
        let programs = policy.tables().programs.iter();
        let output = |bytes| match Program::from_bytes(bytes).target {
            Target::Atomic(output) => output,
            Target::Team(team) => panic!("leads to {team:?}"),
        };
        programs.map(output).collect()
    }

    #[test]
    fn champions_do_in_the_loop_and_on_any_number_of_threads_what_was_scored() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, preset, settings, outputs) in [
            ("evolved", "half-cheetah-sr-sm-b23", EVOLVED.as_slice(), 6),
            ("tuned", "hopper-linear-b23", TUNED.as_slice(), 3),
        ] {
            let [file, other] = ["1", "2"].map(|threads| {
                let out = folder.path().join(format!("{name}-{threads}"));
                train(preset, threads, settings, &out)
            });
            let bytes = std::fs::read(&file).expect("a champion");
            assert!(bytes == std::fs::read(other).expect("a champion"), "{name}");
            let policy = Policy::load(&bytes).expect("valid");
            assert_eq!(policy.header().action_kind, ActionKind::Each);
            assert_eq!(policy.header().outputs(), outputs);
            let targets = targets(&policy);
            println!("{name}: {targets:?}");
            let file = text(&file);
            let arguments = ["--episodes", "4", "--seed", "5", "--json"];
            let run = |verb| tpg_json(&[&[verb, file], arguments.as_slice()].concat());
            assert_eq!(run("eval")["returns"], run("hil")["returns"], "{name}");
        }
    }

    #[test]
    fn every_tool_takes_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = train("hopper-linear-b23", "2", &TUNED, &folder.path().join("run"));
        let (file, path) = (text(&file), |name: &str| folder.path().join(name));
        let inspected = tpg_json(&["inspect", file, "--json"]);
        let programs = inspected["programs_of_outputs"].as_array().expect("a list");
        assert_eq!(programs.len(), 3, "{inspected}");
        let dot = path("dot");
        let output = tpg(["inspect", file, "--disassemble", "--dot", text(&dot)]);
        let said = String::from_utf8(output.stdout).expect("text");
        let graph = std::fs::read_to_string(dot).expect("a graph");
        for output in ["output 0 (", "output 1 (", "output 2 ("] {
            assert!(said.contains(&format!("-> {output}")), "{said}");
            assert!(graph.contains(output), "{graph}");
        }
        let trace = path("trace");
        tpg_ok(&["eval", file, "--episodes", "1", "--trace", text(&trace)]);
        tpg_ok(&["replay", text(&trace), file]);
        let lines = std::fs::read_to_string(trace).expect("a trace");
        let first: serde_json::Value =
            serde_json::from_str(lines.lines().nth(2).expect("a decision")).expect("JSON");
        let visit = &first["decision"]["path"][0];
        assert_eq!(
            visit["outputs"].as_array().map(Vec::len),
            Some(3),
            "{visit}"
        );
        let [rust, c] = ["p.rs", "p.c"].map(path);
        tpg_ok(&["export", file, "--rust", text(&rust), "--c", text(&c)]);
    }

    /// Nothing of the setting is in the configuration of a run that does not use it.
    #[test]
    fn the_default_leaves_no_trace_in_a_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let run = |name: &str, settings: &[&str]| {
            let out = folder.path().join(name);
            let mut arguments = vec![
                "train",
                "hopper-sr",
                "--generations",
                "1",
                "--out",
                text(&out),
            ];
            arguments.extend([
                "--set",
                "evolution.population=3",
                "--set",
                "evolution.children=2",
            ]);
            arguments.extend(settings);
            tpg_ok(&arguments);
            let read = |file| std::fs::read(out.join(file)).expect("a file");
            (
                read("champion.tpg"),
                String::from_utf8(read("config.toml")).expect("text"),
            )
        };
        let (plain, config) = run("plain", &[]);
        assert!(!config.contains("action-programs"), "{config}");
        let (named, _) = run("named", &["--set", "policy.action-programs=winner"]);
        assert!(plain == named);
        let (each, config) = run("each", &["--set", "policy.action-programs=each"]);
        assert!(
            plain != each && config.contains("action-programs = \"each\""),
            "{config}"
        );
    }
}
