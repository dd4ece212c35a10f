//! What plant and policy must agree on, read from the bytes of a contract (docs/format-3.md), and how two of them differ.

use std::fmt;

use tpg_runtime::Policy;
use tpg_runtime::blob::contract_bytes;

/// Differences of channels that a message names; it counts the others.
const NAMED: usize = 6;

/// One input or output.
#[derive(Debug, Clone, PartialEq)]
struct Channel {
    name: String,
    unit: String,
    low: f32,
    high: f32,
}

/// What plant and policy must agree on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contract {
    continuous: bool,
    actions: u16,
    period_us: u32,
    inputs: Vec<Channel>,
    outputs: Vec<Channel>,
}

/// The bytes of a policy's contract.
pub(super) fn bytes_of(policy: &Policy<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    contract_bytes(policy.header(), policy.tables(), |part| {
        bytes.extend_from_slice(part);
    });
    bytes
}

impl Contract {
    /// Reads the bytes of a contract. `None` if they are malformed.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let rest = &mut bytes.strip_prefix(b"TPGC\x01")?;
        let continuous = match take::<1>(rest)? {
            [0] => false,
            [1] => true,
            _ => return None,
        };
        let inputs = u16::from_le_bytes(take(rest)?);
        let actions = u16::from_le_bytes(take(rest)?);
        let period_us = u32::from_le_bytes(take(rest)?);
        let outputs = if continuous { actions } else { 0 };
        let mut channels = |n: u16| (0..n).map(|_| channel(rest)).collect::<Option<Vec<_>>>();
        let contract = Contract {
            continuous,
            actions,
            period_us,
            inputs: channels(inputs)?,
            outputs: channels(outputs)?,
        };
        rest.is_empty().then_some(contract)
    }

    /// How the contract `new` differs from this one, which is the board's, in the words of a message.
    pub(super) fn differences(&self, new: &Contract) -> Vec<String> {
        let mut found = Vec::new();
        let mut compare = |what: &str, there: String, here: String| {
            if there != here {
                found.push(format!(
                    "{what} {there} on the board, {here} in the new policy"
                ));
            }
        };
        compare("control period is", self.period(), new.period());
        compare(
            "observation has",
            format!("{} values", self.inputs.len()),
            format!("{} values", new.inputs.len()),
        );
        compare("action is", self.action(), new.action());
        let mut channels = compare_channels("observation", &self.inputs, &new.inputs);
        channels.extend(compare_channels("output", &self.outputs, &new.outputs));
        let more = channels.len().saturating_sub(NAMED);
        channels.truncate(NAMED);
        found.extend(channels);
        if more > 0 {
            found.push(format!("{more} more channels differ"));
        }
        found
    }

    fn period(&self) -> String {
        match self.period_us {
            0 => "not set".to_owned(),
            us => format!("{} ms", f64::from(us) / 1000.0),
        }
    }

    fn action(&self) -> String {
        if self.continuous {
            format!("continuous with {} outputs", self.actions)
        } else {
            format!("one of {}", self.actions)
        }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`", self.name)?;
        if !self.unit.is_empty() {
            write!(f, " in {}", self.unit)?;
        }
        Ok(())
    }
}

impl Channel {
    fn range(&self) -> String {
        let unit = if self.unit.is_empty() { "" } else { " " };
        format!("{} to {}{unit}{}", self.low, self.high, self.unit)
    }
}

/// Compares the channels that both have; their numbers were compared before.
fn compare_channels(kind: &str, there: &[Channel], here: &[Channel]) -> Vec<String> {
    let names = |channels: &[Channel]| {
        let mut names: Vec<_> = channels.iter().map(Channel::to_string).collect();
        names.sort();
        names
    };
    if names(there) == names(here) {
        let moved = there.iter().zip(here).position(|(a, b)| a.name != b.name);
        if let Some(k) = moved {
            return vec![format!(
                "{kind} has the same values in another order: number {} is {} on the board, {} in the new policy",
                k + 1,
                there[k],
                here[k]
            )];
        }
    }
    let mut found = Vec::new();
    for (k, (there, here)) in there.iter().zip(here).enumerate() {
        let number = k + 1;
        if (&there.name, &there.unit) != (&here.name, &here.unit) {
            found.push(format!(
                "{kind} {number} is {there} on the board, {here} in the new policy"
            ));
        } else if there != here {
            found.push(format!(
                "range of {kind} {number} `{}` is {} on the board, {} in the new policy",
                there.name,
                there.range(),
                here.range()
            ));
        }
    }
    found
}

fn channel(rest: &mut &[u8]) -> Option<Channel> {
    let end = rest.iter().position(|byte| *byte == b'\n')?;
    let (line, after) = rest.split_at(end);
    *rest = &after[1..];
    let (name, unit) = std::str::from_utf8(line).ok()?.split_once('\t')?;
    Some(Channel {
        name: name.to_owned(),
        unit: unit.to_owned(),
        low: f32::from_le_bytes(take(rest)?),
        high: f32::from_le_bytes(take(rest)?),
    })
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, unit: &str, range: (f32, f32)) -> Channel {
        Channel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            low: range.0,
            high: range.1,
        }
    }

    const OPEN: (f32, f32) = (f32::NEG_INFINITY, f32::INFINITY);

    fn contract() -> Contract {
        Contract {
            continuous: true,
            actions: 1,
            period_us: 8_000,
            inputs: vec![channel("height", "m", OPEN), channel("speed", "m/s", OPEN)],
            outputs: vec![channel("torque", "N m", (-1.0, 1.0))],
        }
    }

    #[test]
    fn the_example_of_the_specification_is_read() {
        let bytes =
            b"TPGC\x01\x00\x01\x00\x02\x00\x20\x4e\x00\x00x\tm\n\x00\x00\x80\xff\x00\x00\x80\x7f";
        let contract = Contract::read(bytes).expect("well-formed");
        assert_eq!(contract.inputs, [channel("x", "m", OPEN)]);
        assert_eq!((contract.actions, contract.period_us), (2, 20_000));
        for cut in 0..bytes.len() {
            assert_eq!(Contract::read(&bytes[..cut]), None, "cut at {cut}");
        }
        assert_eq!(Contract::read(&[&bytes[..], b"x"].concat()), None);
    }

    #[test]
    fn differences_name_quantities_and_units() {
        let board = contract();
        assert_eq!(board.differences(&board), Vec::<String>::new());
        let differs = |change: &dyn Fn(&mut Contract), text: &str| {
            let mut new = contract();
            change(&mut new);
            let found = board.differences(&new);
            assert_eq!(found.len(), 1, "{found:?}");
            assert_eq!(found[0], text);
        };
        differs(
            &|c| c.period_us = 50_000,
            "control period is 8 ms on the board, 50 ms in the new policy",
        );
        differs(
            &|c| c.inputs[1].unit = "km/h".into(),
            "observation 2 is `speed` in m/s on the board, `speed` in km/h in the new policy",
        );
        differs(
            &|c| c.inputs.reverse(),
            "observation has the same values in another order: number 1 is `height` in m on the board, `speed` in m/s in \
             the new policy",
        );
        differs(
            &|c| c.outputs[0].high = 3.0,
            "range of output 1 `torque` is -1 to 1 N m on the board, -1 to 3 N m in the new policy",
        );
        differs(
            &|c| c.inputs.truncate(1),
            "observation has 2 values on the board, 1 values in the new policy",
        );
        differs(
            &|c| {
                (c.continuous, c.actions) = (false, 5);
                c.outputs.clear();
            },
            "action is continuous with 1 outputs on the board, one of 5 in the new policy",
        );
    }
}
