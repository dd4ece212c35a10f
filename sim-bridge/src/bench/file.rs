//! The bench file: policies, scenarios, requirements.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use serde::Deserialize;
use toml::{Table, Value};
use tpg_tasks::console::one_line;
use tpg_tasks::exit_status::{Failure, Fault as _};
use tpg_tasks::task::locate_in;

/// Arguments of `tpg hil` that a bench sets itself.
const OWN: [&str; 6] = [
    "file",
    "json",
    "junit",
    "latency-histogram",
    "record",
    "require",
];

/// A bench file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BenchFile {
    name: Option<String>,
    /// What every case has to fulfil.
    #[serde(default)]
    require: Vec<String>,
    /// Arguments of every case.
    #[serde(default, rename = "loop")]
    arguments: Table,
    #[serde(default)]
    policy: Vec<PolicyEntry>,
    #[serde(default)]
    scenario: Vec<ScenarioEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PolicyEntry {
    file: PathBuf,
    name: Option<String>,
    #[serde(default)]
    require: Vec<String>,
    #[serde(default, rename = "loop")]
    arguments: Table,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioEntry {
    name: String,
    /// Disturbances, as after `--disturb`.
    #[serde(default)]
    disturb: Vec<String>,
    /// A file with further ones, one a line.
    script: Option<PathBuf>,
    #[serde(default)]
    require: Vec<String>,
    #[serde(default, rename = "loop")]
    arguments: Table,
}

/// One policy in one scenario.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// POLICY / SCENARIO.
    pub(super) name: String,
    pub(super) policy: String,
    pub(super) scenario: String,
    /// The command line of `tpg hil`.
    pub(super) arguments: Vec<OsString>,
}

impl Case {
    /// A file of this case.
    pub(super) fn path(&self, folder: &Path, extension: &str) -> PathBuf {
        let safe = |c: char| {
            if c.is_alphanumeric() || "-_.".contains(c) {
                c
            } else {
                '-'
            }
        };
        let words =
            [&self.policy, &self.scenario].map(|word| word.chars().map(safe).collect::<String>());
        folder.join(format!("{}.{extension}", words.join("--")))
    }
}

impl BenchFile {
    /// Reads a bench file.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let shown = path.display();
        let text = std::fs::read_to_string(path).or_bad_input(format!("cannot read {shown}"))?;
        let bench: BenchFile = toml::from_str(&text).map_err(|error| {
            Failure::bad_input(anyhow!("cannot use {shown}: {}", one_line(error)))
        })?;
        if bench.policy.is_empty() {
            return Err(Failure::bad_input(anyhow!(
                "{shown} lists no policy: add a table [[policy]] with `file = \"champion.tpg\"`"
            )));
        }
        Ok(bench)
    }

    /// The bench's name, by default its file's.
    pub(super) fn name(&self, path: &Path) -> String {
        self.name.clone().unwrap_or_else(|| stem(path))
    }

    /// Every policy in every scenario.
    pub(super) fn cases(&self, path: &Path) -> Result<Vec<Case>, Failure> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let nominal = [ScenarioEntry {
            name: "nominal".into(),
            ..ScenarioEntry::default()
        }];
        let scenarios = if self.scenario.is_empty() {
            &nominal[..]
        } else {
            &self.scenario
        };
        let mut cases: Vec<Case> = Vec::new();
        for policy in &self.policy {
            for scenario in scenarios {
                let case = self.case(policy, scenario, folder);
                let case = case.map_err(|Failure { status, error }| {
                    Failure::new(
                        status,
                        error.context(format!("cannot use {}", path.display())),
                    )
                })?;
                if cases
                    .iter()
                    .any(|other| other.path(folder, "") == case.path(folder, ""))
                {
                    return Err(Failure::bad_input(anyhow!(
                        "{}: two cases are called {}: give each policy and scenario a `name` of its own",
                        path.display(),
                        case.name
                    )));
                }
                cases.push(case);
            }
        }
        Ok(cases)
    }

    fn case(
        &self,
        policy: &PolicyEntry,
        scenario: &ScenarioEntry,
        folder: &Path,
    ) -> Result<Case, Failure> {
        let policy_name = policy.name.clone().unwrap_or_else(|| stem(&policy.file));
        let mut arguments = vec![folder.join(&policy.file).into_os_string()];
        // The closer a table is to the case, the later it is merged.
        let mut merged = self.arguments.clone();
        merged.extend(policy.arguments.clone());
        merged.extend(scenario.arguments.clone());
        for (key, value) in &merged {
            if OWN.contains(&key.as_str()) {
                return Err(Failure::bad_input(anyhow!(
                    "[loop] cannot set {key:?}, which the bench itself sets"
                )));
            }
            push_argument(&mut arguments, key, value, folder)?;
        }
        let mut push = |flag: &str, text: &str| {
            // In one word, since a disturbance or a requirement may begin with a hyphen.
            arguments.push(format!("--{flag}={text}").into());
        };
        for disturbance in &scenario.disturb {
            push("disturb", disturbance);
        }
        if let Some(script) = &scenario.script {
            let script = folder.join(script);
            let text = std::fs::read_to_string(&script)
                .or_bad_input(format!("cannot read {}", script.display()))?;
            let lines = text
                .lines()
                .map(|line| line.split('#').next().unwrap_or(line).trim());
            lines
                .filter(|line| !line.is_empty())
                .for_each(|line| push("disturb", line));
        }
        for requirement in self
            .require
            .iter()
            .chain(&policy.require)
            .chain(&scenario.require)
        {
            push("require", requirement);
        }
        Ok(Case {
            name: format!("{policy_name} / {}", scenario.name),
            policy: policy_name,
            scenario: scenario.name.clone(),
            arguments,
        })
    }
}

/// Appends a key of `[loop]` as an argument; `tpg hil` says whether it knows it.
fn push_argument(
    arguments: &mut Vec<OsString>,
    key: &str,
    value: &Value,
    folder: &Path,
) -> Result<(), Failure> {
    let text = match value {
        Value::Boolean(false) => return Ok(()),
        Value::Boolean(true) => {
            arguments.push(format!("--{key}").into());
            return Ok(());
        }
        Value::Array(values) => {
            return (values.iter())
                .try_for_each(|value| push_argument(arguments, key, value, folder));
        }
        Value::Integer(number) => number.to_string(),
        // The file of a task lies beside the bench file.
        Value::String(text) if key == "task" => locate_in(folder, text),
        Value::String(text) => text.clone(),
        _ => {
            return Err(Failure::bad_input(anyhow!(
                "[loop] {key} is {value}: write a number, a text, true, or a list of them"
            )));
        }
    };
    arguments.push(format!("--{key}={text}").into());
    Ok(())
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}
