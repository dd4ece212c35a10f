//! What holds of every key and every preset.

use toml::{Table, Value};

use super::preset::{DEFAULTS, Preset, parse, presets};
use super::schema::{Config, Curriculum, SelectionParams, check};
use super::{Settings, leaves, resolve};
use crate::front_end::FrontEndParams;
use crate::keys::{Key, Values};
use crate::tune::TuningParams;
use tpg_tasks::eval::Shaping;

/// Every key that takes no table, with its path.
fn keys() -> Vec<(String, Values)> {
    fn collect(keys: &[Key], prefix: &str, all: &mut Vec<(String, Values)>) {
        for key in keys {
            let path = format!("{prefix}{}", key.name);
            match key.values {
                Values::Table(keys) => collect(keys, &format!("{path}."), all),
                values => all.push((path, values)),
            }
        }
    }
    let mut all = Vec::new();
    collect(Config::KEYS, "", &mut all);
    all
}

/// What the schema says of a table in which nothing but this key is set.
fn checked(path: &str, value: &Value) -> Result<(), String> {
    let mut table = value.clone();
    for part in path.rsplit('.') {
        table = Value::Table(Table::from_iter([(part.to_owned(), table)]));
    }
    let Value::Table(table) = table else {
        unreachable!("a path has parts")
    };
    check(&table).map_err(|error| error.to_string())
}

fn defaults() -> Config {
    let table = parse(DEFAULTS).expect("well-formed");
    check(&table).expect("within the bounds");
    Config::try_from(Value::Table(table)).expect("complete")
}

#[test]
fn every_preset_makes_sense() {
    for preset in presets().expect("well-formed") {
        let config = resolve(&preset, None, &[]).expect("complete");
        match Settings::new(&config) {
            Ok(settings) => {
                assert_eq!(settings.policy_spec.observability, preset.observability);
            }
            // Without MuJoCo its tasks are known but cannot be made.
            Err(e) => assert!(
                cfg!(not(feature = "mujoco"))
                    && !["cartpole", "acrobot", "pendulum"].contains(&preset.task)
                    && preset.variant != "memory",
                "{e}"
            ),
        }
    }
}

#[test]
fn the_schema_lists_the_keys_of_the_defaults() {
    let table = parse(DEFAULTS).expect("well-formed");
    let mut listed: Vec<String> = keys().into_iter().map(|(path, _)| path).collect();
    listed.sort_unstable();
    let mut defaults: Vec<String> = leaves(&table, "").into_iter().map(|(p, _)| p).collect();
    defaults.sort_unstable();
    assert_eq!(listed, defaults);
}

#[test]
fn every_number_is_refused_below_and_above_its_bounds() {
    for (path, values) in keys() {
        let (within, outside) = match values {
            Values::Whole { min, max } => {
                let [min, max] = [min, max].map(|n| i64::try_from(n).expect("TOML holds it"));
                (
                    [min, max].map(Value::Integer).to_vec(),
                    [min - 1, max + 1, i64::MAX].map(Value::Integer).to_vec(),
                )
            }
            Values::Number { min, max } => (
                [min, max].map(Value::Float).to_vec(),
                [
                    min.next_down(),
                    max.next_up(),
                    f64::NAN,
                    f64::INFINITY,
                    f64::NEG_INFINITY,
                ]
                .map(Value::Float)
                .to_vec(),
            ),
            _ => continue,
        };
        for value in within {
            assert_eq!(checked(&path, &value), Ok(()));
        }
        for value in outside {
            let message = checked(&path, &value).expect_err("out of bounds");
            assert!(message.starts_with(&format!("{path} = {value}: must be ")));
        }
    }
}

#[test]
fn every_misspelt_name_is_refused_with_the_nearest() {
    for (path, values) in keys() {
        let (names, list) = match values {
            Values::Name(names) => (names(), false),
            Values::Names(names) => (names(), true),
            _ => continue,
        };
        for name in names {
            let text = |text: &str| match (list, Value::String(text.into())) {
                (true, name) => Value::Array(vec![name]),
                (false, name) => name,
            };
            assert_eq!(checked(&path, &text(name)), Ok(()));
            let wrong = format!("{name}x");
            let message = checked(&path, &text(&wrong)).expect_err("no such name");
            let suggestion = format!("did you mean {name:?}?");
            assert!(
                message.contains(&path) && message.contains(&wrong),
                "{message}"
            );
            assert!(message.contains(&suggestion), "{message}");
        }
    }
}

#[test]
fn every_value_of_another_type_is_refused() {
    for (path, _) in keys() {
        let value = Value::Table(Table::new());
        let message = checked(&path, &value).expect_err("no key takes an empty table");
        assert!(
            message.contains(&path) && message.contains("invalid type"),
            "{message}"
        );
    }
}

/// `presets/defaults.toml` states every default. The types state those of settings that written configurations leave out.
#[test]
fn the_types_have_the_defaults_of_the_file() {
    let defaults = defaults();
    assert_eq!(defaults.tuning, TuningParams::default());
    assert_eq!(defaults.selection, SelectionParams::default());
    assert_eq!(defaults.front_end, FrontEndParams::default());
    assert_eq!(defaults.evaluation.shaping, Shaping::default());
    assert_eq!(defaults.evaluation.curriculum, Curriculum::default());
    let written = toml::to_string(&defaults).expect("tables, numbers and text");
    let left_out = [
        "tuning",
        "selection",
        "front-end",
        "elites",
        "drop-after",
        "shaping",
        "max-steps",
        "curriculum",
        "initial =",
        "reset =",
        "grow",
        "remember",
        "ties",
        "insist",
        "copies",
        "memory-writes",
        "action-programs",
        "history =",
    ];
    for key in left_out {
        assert!(!written.contains(key), "{key} is written:\n{written}");
    }
    let read: Config = toml::from_str(&written).expect("complete");
    assert_eq!(read, defaults);
}

/// Settings that go beyond the thesis are left out one by one inside tables that are written.
#[test]
fn what_is_left_out_inside_a_written_table_has_the_defaults_of_the_file() {
    let mut config = defaults();
    config.tuning.lineages = 2;
    config.front_end.standardise = true;
    let written = toml::to_string(&config).expect("tables, numbers and text");
    for key in ["half-life", "halve", "others", "outlier"] {
        assert!(!written.contains(key), "{key} is written:\n{written}");
    }
    let read: Config = toml::from_str(&written).expect("complete");
    assert_eq!(read, config);
}

/// Champions carry a hash of the written configuration, so that its text must not change.
#[test]
fn a_written_configuration_keeps_its_text() {
    let preset = Preset::find("cartpole-sr-sm-uniform-b23").expect("exists");
    let sets = ["evolution.initial=\"linear\"", "front-end.columns=auto"].map(str::to_owned);
    let config = resolve(&preset, None, &sets).expect("complete");
    let written = toml::to_string(&config).expect("tables, numbers and text");
    for line in [
        "task = \"cartpole-v1\"",
        "observability = [\"blackout:2/3\"]",
        "groups = [\"scalar\", \"vector\", \"matrix\", \"constants\", \"team-memory\"]",
        "register-mode = \"stateful\"",
        "reset-scope = \"per-episode\"",
        "memory-sections = [\"scalar\", \"vector\", \"matrix\"]",
        "memory-writes = \"uniform\"",
        "initial = \"linear\"",
        "columns = \"auto\"",
    ] {
        assert!(written.lines().any(|l| l == line), "{line}\n{written}");
    }
    assert_eq!(toml::from_str::<Config>(&written), Ok(config));
}

#[test]
fn training_may_be_disturbed() {
    let preset = Preset::find("cartpole-sr-b23").expect("exists");
    let sets =
        ["evaluation.disturb=[\"nan:pole_angle:1/50\", \"at 1s stuck:0 for 0.5s\"]".to_owned()];
    let config = resolve(&preset, None, &sets).expect("complete");
    let written = toml::to_string(&config).expect("tables, numbers and text");
    assert_eq!(toml::from_str::<Config>(&written), Ok(config.clone()));
    let settings = Settings::new(&config).expect("the channels exist");
    assert_eq!(settings.disturb.len(), 2);
    let arena = settings.arena().expect("a task");
    let error = Settings::external(&config, arena.task().spec()).expect_err("an environment's own");
    assert!(error.to_string().contains("evaluation.disturb"), "{error}");
}

#[test]
fn settings_that_make_no_sense_together_are_refused() {
    let preset = Preset::find("cartpole-sr-b23").expect("exists");
    let refused = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        let config = resolve(&preset, None, &sets).expect("each alone is right");
        Settings::new(&config).expect_err("senseless").to_string()
    };
    for (sets, says) in [
        (&["evolution.children=0"][..], "at least 1"),
        (
            &["evolution.constants.factor-min=3"],
            "evolution.constants.factor-max = 2",
        ),
        (
            &["evolution.team.size.initial-max=11"],
            "initial-min <= initial-max <= max",
        ),
        (
            &["observability=[]", "evaluation.curriculum.steps=9"],
            "no blackout",
        ),
        (
            &["tuning.lines=1", "tuning.top=17"],
            "tuning.directions = 16",
        ),
        (&["tuning.lines=1", "tuning.halve=true"], "tuning.one-after"),
        (&["policy.groups=[]"], "at least one instruction group"),
        (
            &["evaluation.disturb=[\"stuck:4\"]"],
            "stuck:4 names no channel of this policy; there are 0 cart_position",
        ),
    ] {
        let message = refused(sets);
        assert!(message.contains(says), "{sets:?}: {message}");
    }
}
