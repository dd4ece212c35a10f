//! `tpg inspect --disassemble`: whoever reads it can work out what the policy does.

use std::path::Path;

use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tests::process::tpg_ok;

fn disassembled(file: &str) -> (String, Vec<u8>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    let words = ["inspect", path.to_str().expect("text"), "--disassemble"];
    let output = tpg_ok(&words);
    let text = String::from_utf8(output.stdout).expect("text");
    (text, std::fs::read(path).expect("a policy"))
}

/// The numbers of a line behind its first word.
fn numbers(line: &str) -> Vec<f64> {
    let words = line.split_whitespace().skip(1);
    words.filter_map(|word| word.parse().ok()).collect()
}

/// A linear policy, computed by hand from what is printed, gives the runtime's action.
#[test]
fn the_gains_of_a_linear_policy_are_a_table_that_can_be_calculated_with() {
    let (text, bytes) = disassembled("docs/champions/hopper-b23.tpg");
    for words in ["v0 = m0 · obs\n", "v0 = v0 + v1\n", "obs is standardised"] {
        assert!(text.contains(words), "{text}");
    }
    let policy = Policy::load(&bytes).expect("a policy");
    let inputs: Vec<String> = policy.inputs().map(|(name, _)| name.to_owned()).collect();
    let lines: Vec<&str> = text.lines().collect();
    let head = lines.iter().position(|line| line.starts_with("  m0 "));
    let head = head.expect("a table");
    let outputs: Vec<&str> = lines[head].split_whitespace().skip(1).collect();
    let named: Vec<&str> = policy.outputs().map(|(name, _)| name).collect();
    assert_eq!(outputs, named);
    let gains: Vec<Vec<f64>> = inputs
        .iter()
        .zip(&lines[head + 1..])
        .map(|(input, line)| {
            assert_eq!(line.split_whitespace().next(), Some(input.as_str()));
            numbers(line)
        })
        .collect();
    let offset = lines.iter().find(|line| line.starts_with("  v1 = ("));
    let offset = offset.expect("an offset").replace(['(', ')', ','], " ");
    let offset = numbers(&offset);

    let front_end = policy.front_end().expect("one");
    let float = |bytes: [u8; 4]| f64::from(f32::from_le_bytes(bytes));
    let observation: Vec<f32> = (0..inputs.len()).map(|k| 0.1 * k as f32 - 0.3).collect();
    let standardised: Vec<f64> = (observation.iter().enumerate())
        .map(|(k, x)| (f64::from(*x) - float(front_end.means[k])) * float(front_end.scales[k]))
        .collect();
    let mut agent = Box::new(HostAgent::new(policy).expect("an agent"));
    agent.reset(Reset::Agent, 1);
    let decision = agent.decide(&observation).expect("a decision");
    let tpg_runtime::Action::Continuous(action) = decision.action else {
        panic!("a continuous action");
    };
    assert_eq!(action.len(), outputs.len());
    for (k, value) in action.iter().enumerate() {
        let products = gains.iter().zip(&standardised).map(|(row, x)| row[k] * x);
        let by_hand = products.sum::<f64>() + offset[k];
        // Four digits are printed, and actions are cut to their bounds.
        let error = (by_hand.clamp(-1.0, 1.0) - f64::from(*value)).abs();
        assert!(error < 0.01, "output {k}: {by_hand} by hand, {value}");
    }
}

#[test]
fn inputs_have_their_names_and_registers_their_first_values() {
    let (text, _) = disassembled("docs/champions/cartpole.tpg");
    for words in [
        "  s1 = -0.2596\n",
        "  v1 = (0.3815, 0.7250) at reset\n",
        "    cart_position      0.1697\n    pole_angle         -1.984\n",
        "  s0 = ⟨v0, obs⟩\n",
    ] {
        assert!(text.contains(words), "no {words:?} in {text}");
    }
    let (text, _) = disassembled("tests/golden/champions/hopper-sr-sm-b23.tpg");
    assert!(text.contains("s0 = tanh(torso_angular_velocity)"), "{text}");
}
