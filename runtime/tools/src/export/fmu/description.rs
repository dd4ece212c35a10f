//! The XML files of a unit.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use tpg_runtime::Policy;
use tpg_runtime::tables::Range;

use super::nearest_to_zero;

/// The file `modelDescription.xml`.
pub(super) fn model_description(policy: &Policy<'_>, name: &str, token: &str) -> String {
    let (header, tables) = (policy.header(), policy.tables());
    let about = format!("A policy for {} ({}).", tables.task, tables.observability);
    let period = header.control_period_us;
    let seconds = format!("{}.{:06}", period / 1_000_000, period % 1_000_000);
    let (fixed, experiment) = if period > 0 {
        (
            format!(
                "canHandleVariableCommunicationStepSize=\"false\" fixedInternalStepSize=\"{seconds}\""
            ),
            format!("  <DefaultExperiment startTime=\"0\" stepSize=\"{seconds}\"/>\n"),
        )
    } else {
        (
            "canHandleVariableCommunicationStepSize=\"true\"".to_owned(),
            String::new(),
        )
    };
    let variables = variables(policy);
    let outputs = variables.outputs.iter();
    let outputs: String = outputs
        .map(|reference| {
            format!("    <Output valueReference=\"{reference}\" dependencies=\"\"/>\n")
        })
        .collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" instantiationToken=\"{token}\"
    description=\"{}\" generationTool=\"tpg\" variableNamingConvention=\"flat\">
  <CoSimulation modelIdentifier=\"{name}\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\"
      {fixed}/>
{}  <LogCategories>
    <Category name=\"logStatusError\" description=\"why a call failed\"/>
  </LogCategories>
{experiment}  <ModelVariables>
{}  </ModelVariables>
  <ModelStructure>
{outputs}  </ModelStructure>
</fmiModelDescription>
",
        escape(&about),
        units(policy),
        variables.text
    )
}

/// The file `sources/buildDescription.xml`.
pub(super) fn build_description(name: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<fmiBuildDescription fmiVersion=\"3.0\">
  <BuildConfiguration modelIdentifier=\"{name}\">
    <SourceFileSet language=\"C99\" compilerOptions=\"-ffp-contract=off\">
      <SourceFile name=\"{name}.c\"/>
      <SourceFile name=\"fmi3.c\"/>
    </SourceFileSet>
    <Library name=\"m\" external=\"true\" description=\"the C library's functions floor and fabs\"/>
  </BuildConfiguration>
</fmiBuildDescription>
"
    )
}

struct Variables {
    text: String,
    /// Value references of the outputs.
    outputs: Vec<u32>,
}

/// The variables, in the order of their value references: time, inputs, outputs, seed.
fn variables(policy: &Policy<'_>) -> Variables {
    let header = policy.header();
    let (mut names, mut text) = (Names::default(), String::new());
    let mut reference = 0u32;
    let mut outputs = Vec::new();
    // Writing to a string cannot fail.
    let mut add = |element: &str, name: &str, rest: &str| {
        let name = escape(&names.take(name));
        let _ = writeln!(
            text,
            "    <{element} name=\"{name}\" valueReference=\"{reference}\" {rest}/>"
        );
        reference += 1;
        reference - 1
    };
    add(
        "Float64",
        "time",
        "causality=\"independent\" variability=\"continuous\"",
    );
    for ((name, unit), range) in policy.inputs().zip(policy.input_ranges()) {
        let rest = format!(
            "causality=\"input\" variability=\"continuous\" start=\"{}\"{}{}",
            nearest_to_zero(range),
            bounds(range),
            unit_attribute(unit)
        );
        add("Float32", name, &rest);
    }
    if header.outputs() > 0 {
        for ((name, unit), range) in policy.outputs().zip(policy.output_ranges()) {
            let rest = format!(
                "causality=\"output\" variability=\"discrete\" initial=\"exact\" start=\"{}\"{}{}",
                nearest_to_zero(range),
                bounds(range),
                unit_attribute(unit)
            );
            outputs.push(add("Float32", name, &rest));
        }
    } else {
        let rest = format!(
            "causality=\"output\" variability=\"discrete\" initial=\"exact\" start=\"0\" min=\"0\" max=\"{}\"",
            header.actions.saturating_sub(1)
        );
        outputs.push(add("Int32", "action", &rest));
    }
    add(
        "UInt64",
        "seed",
        "causality=\"parameter\" variability=\"fixed\" start=\"0\" description=\"seed of the policy's random streams\"",
    );
    Variables { text, outputs }
}

/// The attributes of a variable's range. A bound that is not finite has none.
fn bounds(range: Range) -> String {
    let attribute = |name: &str, bound: f32| match bound.is_finite() {
        true => format!(" {name}=\"{bound}\""),
        false => String::new(),
    };
    attribute("min", range.low) + &attribute("max", range.high)
}

/// The definitions of all units that variables name.
fn units(policy: &Policy<'_>) -> String {
    let units = policy.inputs().chain(policy.outputs());
    let units: BTreeSet<&str> = units.map(|(_, unit)| unit).filter(is_unit).collect();
    if units.is_empty() {
        return String::new();
    }
    let lines: String = units
        .iter()
        .map(|unit| format!("    <Unit name=\"{}\"/>\n", escape(unit)))
        .collect();
    format!("  <UnitDefinitions>\n{lines}  </UnitDefinitions>\n")
}

/// Whether a variable with this unit has one in the description. Numbers as such have none.
fn is_unit(unit: &&str) -> bool {
    !unit.is_empty() && *unit != "1"
}

fn unit_attribute(unit: &str) -> String {
    if is_unit(&unit) {
        format!(" unit=\"{}\"", escape(unit))
    } else {
        String::new()
    }
}

/// Names that are taken. The standard asks for different ones.
#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    /// The name, or the name with the first number that makes it a new one.
    fn take(&mut self, name: &str) -> String {
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let mut names = std::iter::once(name.to_owned()).chain(numbered);
        let free = names.find(|name| self.0.insert(name.clone()));
        free.unwrap_or_default()
    }
}

/// Text as the value of an attribute, without control characters.
fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ_and_are_valid_text() {
        let mut names = Names::default();
        let taken = ["x", "x", "x_2", "x"].map(|name| names.take(name));
        assert_eq!(taken, ["x", "x_2", "x_2_2", "x_3"]);
        assert_eq!(escape("a<b & \"c\"\n>"), "a&lt;b &amp; &quot;c&quot;&gt;");
    }
}
