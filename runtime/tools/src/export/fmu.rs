//! A policy as a co-simulation unit of FMI 3.0.

mod archive;
mod description;

use tpg_runtime::Policy;
use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::math::clamp;
use tpg_runtime::tables::Range;

use super::c::{c, number_text};
use description::{build_description, model_description};

/// A unit before it is packed: its description, its sources, and shared libraries that are added to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fmu {
    /// Paths in the unit, with contents.
    files: Vec<(String, Vec<u8>)>,
}

/// The folder of a unit's sources.
const SOURCES: &str = "sources/";

impl Fmu {
    /// The unit of a policy, without a shared library. `name` must be an identifier of C. The unit and its library are
    /// named after it. The first lines of the sources name `command` as their origin.
    #[must_use]
    pub fn new(policy: &Policy<'_>, name: &str, command: &str) -> Self {
        let module = c(policy, name, command);
        let head = start(policy, name, &module.source);
        let wrapper = head + "\n" + include_str!("fmu/fmi3.c");
        let token = token(&[&module.header, &module.source, &wrapper]);
        let wrapper = wrapper.replace("@TOKEN@", &token);
        let files = [
            (
                "modelDescription.xml".to_owned(),
                model_description(policy, name, &token),
            ),
            (
                format!("{SOURCES}buildDescription.xml"),
                build_description(name),
            ),
            (format!("{SOURCES}{name}.h"), module.header),
            (format!("{SOURCES}{name}.c"), module.source),
            (format!("{SOURCES}fmi3.c"), wrapper),
        ];
        let files = files.map(|(path, text)| (path, text.into_bytes()));
        Fmu {
            files: files.into(),
        }
    }

    /// The files to compile and to include, by their names in one folder. Those to compile end with `.c`.
    pub fn sources(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let name = |path: &'_ str| path.strip_prefix(SOURCES).is_some();
        let files = self.files.iter().filter(move |(path, _)| name(path));
        files.map(|(path, content)| (&path[SOURCES.len()..], content.as_slice()))
    }

    /// Adds the shared library for a platform, whose name is that of the standard, such as `x86_64-linux`.
    /// `file` is the unit's name with the platform's ending.
    pub fn add_library(&mut self, platform: &str, file: &str, library: Vec<u8>) {
        self.files
            .push((format!("binaries/{platform}/{file}"), library));
    }

    /// The unit as a file: a ZIP archive that is the same whenever it is made.
    #[must_use]
    pub fn pack(&self) -> Vec<u8> {
        archive::zip(&self.files)
    }
}

/// What distinguishes the interface's source from that of other policies.
fn start(policy: &Policy<'_>, name: &str, source: &str) -> String {
    let upper = name.to_uppercase();
    let outputs = policy.header().outputs();
    let origin = source.split_inclusive("*/\n").next().unwrap_or_default();
    let (count, kind, first, call) = if outputs > 0 {
        let first = first_values(policy.output_ranges());
        let call = format!("{name}_decide(self, inputs, outputs)");
        (format!("{upper}_OUTPUTS"), "float", first, call)
    } else {
        let call = format!("outputs[0] = {name}_decide(self, inputs)");
        ("1".to_owned(), "uint16_t", "0".to_owned(), call)
    };
    format!(
        "{origin}#include \"{name}.h\"

#define INSTANTIATION_TOKEN \"@TOKEN@\"
#define INPUTS {upper}_INPUTS
#define OUTPUTS {count}
#define CONTINUOUS {}
#define CONTROL_PERIOD_S ({upper}_CONTROL_PERIOD_US / 1e6)
#define POLICY_AGENT {upper}_AGENT
#define policy_init {name}_init
#define policy_reset {name}_reset

typedef {name} policy_state;
typedef {kind} output;

static const float first_inputs[INPUTS] = {{{}}};
static const output first_outputs[OUTPUTS] = {{{first}}};

static void decide(policy_state *self, const float inputs[INPUTS], output outputs[OUTPUTS])
{{
    {call};
}}
",
        u8::from(outputs > 0),
        first_values(policy.input_ranges()),
    )
}

/// What inputs and outputs are before they are set, as the elements of an array.
fn first_values(ranges: impl Iterator<Item = Range>) -> String {
    let values = ranges.map(|range| number_text(nearest_to_zero(range)));
    values.collect::<Vec<_>>().join(", ")
}

/// The number of a range that is nearest to 0.
fn nearest_to_zero(range: Range) -> f32 {
    clamp(0.0, range.low, range.high)
}

/// What a description and a library that belong together share.
fn token(texts: &[&str]) -> String {
    let hash = texts
        .iter()
        .fold(START_64, |hash, text| fnv1a_64(hash, text.as_bytes()));
    format!("tpg-{hash:016x}")
}
