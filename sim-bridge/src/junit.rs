//! Results as JUnit XML, which test servers read.

use std::fmt::Write as _;
use std::path::Path;

use tpg_tasks::exit_status::{Failure, Fault as _};

/// What came of a test case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It passed.
    Passed,
    /// It ran, and something does not hold.
    Failed(String),
    /// It could not run to its end.
    Broken(String),
}

/// A test case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// What it is about.
    pub name: String,
    /// What came of it.
    pub verdict: Verdict,
}

/// Test cases that ran together.
#[derive(Debug, Clone, PartialEq)]
pub struct Suite {
    /// What it is about.
    pub name: String,
    /// How long it took, in seconds.
    pub seconds: f64,
    /// Its cases.
    pub cases: Vec<Case>,
}

/// The XML of suites.
fn document(suites: &[Suite]) -> String {
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    for suite in suites {
        let count = |wanted: fn(&Verdict) -> bool| {
            suite
                .cases
                .iter()
                .filter(|case| wanted(&case.verdict))
                .count()
        };
        let failures = count(|verdict| matches!(verdict, Verdict::Failed(_)));
        let errors = count(|verdict| matches!(verdict, Verdict::Broken(_)));
        let (name, cases) = (escape(&suite.name), suite.cases.len());
        // A String takes everything that is written to it.
        let _ = writeln!(
            text,
            "  <testsuite name=\"{name}\" tests=\"{cases}\" failures=\"{failures}\" errors=\"{errors}\" time=\"{:.3}\">",
            suite.seconds
        );
        for case in &suite.cases {
            let case_name = escape(&case.name);
            let _ = write!(
                text,
                "    <testcase classname=\"{name}\" name=\"{case_name}\""
            );
            let _ = match &case.verdict {
                Verdict::Passed => writeln!(text, "/>"),
                Verdict::Failed(message) => element(&mut text, "failure", message),
                Verdict::Broken(message) => element(&mut text, "error", message),
            };
        }
        text.push_str("  </testsuite>\n");
    }
    text.push_str("</testsuites>\n");
    text
}

fn element(text: &mut String, tag: &str, message: &str) -> std::fmt::Result {
    let message = escape(message);
    writeln!(
        text,
        ">\n      <{tag} message=\"{message}\"/>\n    </testcase>"
    )
}

/// A text as the value of an attribute; what XML cannot hold becomes a question mark.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' => escaped.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => escaped.push('?'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Writes suites to a file.
///
/// # Errors
/// Where the file cannot be written.
pub fn write(path: &Path, suites: &[Suite]) -> Result<(), Failure> {
    std::fs::write(path, document(suites)).or_unwritable(path)
}

/// Writes that something could not run to its end.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_broken(path: &Path, name: String, failure: &Failure) -> Result<(), Failure> {
    let suite = Suite {
        name,
        seconds: 0.0,
        cases: vec![Case {
            name: "loop".into(),
            verdict: Verdict::Broken(format!("{:#}", failure.error)),
        }],
    };
    write(path, &[suite])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_escaped_and_counted() {
        let case = |name: &str, verdict| Case {
            name: name.into(),
            verdict,
        };
        let suite = Suite {
            name: "a & b".into(),
            seconds: 1.25,
            cases: vec![
                case("p99 < 2ms", Verdict::Passed),
                case("mean >= 3", Verdict::Failed("mean is \"2\"\u{7}".into())),
                case("loop", Verdict::Broken("gone\nfor good".into())),
            ],
        };
        let expected = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  \
            <testsuite name=\"a &amp; b\" tests=\"3\" failures=\"1\" errors=\"1\" time=\"1.250\">\n    \
            <testcase classname=\"a &amp; b\" name=\"p99 &lt; 2ms\"/>\n    \
            <testcase classname=\"a &amp; b\" name=\"mean &gt;= 3\">\n      \
            <failure message=\"mean is &quot;2&quot;?\"/>\n    </testcase>\n    \
            <testcase classname=\"a &amp; b\" name=\"loop\">\n      \
            <error message=\"gone for good\"/>\n    </testcase>\n  </testsuite>\n</testsuites>\n";
        assert_eq!(document(&[suite]), expected);
    }
}
