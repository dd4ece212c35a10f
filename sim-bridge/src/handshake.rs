//! What both processes must agree on before the first message.

use std::error::Error;

use iceoryx2::prelude::{AttributeSpecifier, SemanticString as _};
use iceoryx2::service::attribute::{AttributeKey, AttributeSet, AttributeValue};
use tpg_runtime::blob::{ActionKind, VERSION};
use tpg_runtime::isa::FINGERPRINT;
use tpg_runtime::{Header, Policy};

use crate::error::BridgeError;
use crate::hash;
use crate::message::{LAYOUT_HASH, MAX_ACTION, MAX_OBSERVATION};

/// Names and values that each process publishes about itself, as attributes of its service.
///
/// The first rows concern the programs, the others the policy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handshake {
    rows: [(&'static str, String); 7],
}

/// How many of the rows concern the programs.
const PROGRAM_ROWS: usize = 3;

/// A row that differs: its name, our value, theirs.
type Difference<'a> = (&'static str, &'a str, &'a str);

impl Handshake {
    /// What a process says that runs this policy, read from these bytes.
    ///
    /// # Errors
    /// [`BridgeError::TooLarge`] if observation or action do not fit a message.
    pub fn new(policy: &Policy<'_>, blob: &[u8]) -> Result<Self, BridgeError> {
        let header = policy.header();
        let inputs = usize::from(header.observation_len);
        check_sizes(header)?;
        let rows = [
            ("message layout", format!("{LAYOUT_HASH:016x}")),
            ("blob format", VERSION.to_string()),
            ("instruction set", format!("{FINGERPRINT:08x}")),
            ("observation", format!("{inputs} values")),
            ("action", action_text(header)),
            ("control period", format!("{} us", header.control_period_us)),
            (
                "policy",
                format!(
                    "{:016x} of {} bytes",
                    hash::bytes(hash::START, blob),
                    blob.len()
                ),
            ),
        ];
        Ok(Handshake { rows })
    }

    /// The rows as attributes of a service.
    pub(crate) fn attributes(&self) -> Result<AttributeSpecifier, BridgeError> {
        let define = |attributes: AttributeSpecifier, key: &str, value: &str| {
            let (key, value) = (
                AttributeKey::try_from(key)?,
                AttributeValue::try_from(value)?,
            );
            Ok::<_, Box<dyn Error + Send + Sync>>(attributes.define(&key, &value)?)
        };
        let mut rows = self.rows.iter();
        rows.try_fold(AttributeSpecifier::new(), |attributes, (key, value)| {
            define(attributes, key, value)
        })
        .map_err(BridgeError::transport("describe the handshake"))
    }

    /// Compares with the attributes of the peer's service; what differs, in words, and what to do about it.
    pub(crate) fn difference(&self, theirs: &AttributeSet) -> Option<(String, &'static str)> {
        let value_of = |key: &str| {
            let attribute = theirs.iter().find(|a| a.key() == key);
            attribute.map_or("missing", |a| {
                std::str::from_utf8(a.value().as_bytes()).unwrap_or("unreadable")
            })
        };
        let differences: Vec<(usize, Difference<'_>)> = (self.rows.iter().enumerate())
            .map(|(k, (key, ours))| (k, (*key, ours.as_str(), value_of(key))))
            .filter(|(_, (_, ours, theirs))| ours != theirs)
            .collect();
        let (first, _) = differences.first()?;
        let advice = if *first < PROGRAM_ROWS {
            "use programs of one and the same build"
        } else {
            "give both the same FILE.tpg"
        };
        let text: Vec<String> = differences
            .iter()
            .map(|(_, (key, ours, theirs))| format!("{key} is {ours} here, {theirs} there"))
            .collect();
        Some((text.join("; "), advice))
    }
}

/// Whether observation and action fit a message.
pub(crate) fn check_sizes(header: &Header) -> Result<(), BridgeError> {
    fits("inputs", header.observation_len.into(), MAX_OBSERVATION)?;
    fits("outputs", header.outputs(), MAX_ACTION)
}

fn fits(what: &'static str, got: usize, limit: usize) -> Result<(), BridgeError> {
    if got <= limit {
        Ok(())
    } else {
        Err(BridgeError::TooLarge { what, got, limit })
    }
}

fn action_text(header: &Header) -> String {
    let (kind, count) = (header.action_kind.name(), header.actions);
    match header.action_kind {
        ActionKind::Discrete => format!("{kind}, one of {count}"),
        _ => {
            let (low, high) = (header.action_low, header.action_high);
            format!("{kind}, {count} values from {low} to {high}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn handshake() -> Handshake {
        let rows = [
            "layout",
            "format",
            "isa",
            "observation",
            "action",
            "period",
            "policy",
        ];
        Handshake {
            rows: rows.map(|row| (row, "1".to_string())),
        }
    }

    fn published(handshake: &Handshake) -> AttributeSpecifier {
        handshake.attributes().unwrap()
    }

    #[test]
    fn equal_handshakes_do_not_differ() {
        assert_eq!(
            handshake().difference(published(&handshake()).attributes()),
            None
        );
    }

    #[test]
    fn difference_names_the_row_both_values_and_the_way_out() {
        let mut other = handshake();
        other.rows[3].1 = "2".into();
        other.rows[6].1 = "3".into();
        let expected = "observation is 1 here, 2 there; policy is 1 here, 3 there";
        assert_eq!(
            handshake().difference(published(&other).attributes()),
            Some((expected.into(), "give both the same FILE.tpg"))
        );
        other.rows[0].1 = "4".into();
        let (_, advice) = handshake()
            .difference(published(&other).attributes())
            .unwrap();
        assert_eq!(advice, "use programs of one and the same build");
    }

    #[test]
    fn foreign_services_miss_every_row() {
        let (text, _) = handshake()
            .difference(AttributeSpecifier::new().attributes())
            .unwrap();
        assert!(
            text.starts_with("layout is 1 here, missing there"),
            "{text}"
        );
    }
}
