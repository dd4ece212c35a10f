//! `tpg eval --health`: a stuck sensor is seen by the policy's own model, and healthy ones are not suspected.

use std::path::{Path, PathBuf};

use tpg_tests::process::{stderr, text, tpg};

fn champion(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/champions/{name}.tpg"))
}

#[test]
fn a_policy_without_a_model_has_no_health() {
    let output = tpg(["eval", text(&champion("cartpole")), "--health"]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("no model") && said.contains("cartpole"),
        "{said}"
    );
}

#[cfg(feature = "mujoco")]
mod hopper {
    use serde_json::Value;
    use tpg_tests::process::{text, tpg_json, tpg_ok};

    use super::champion;

    /// The share that an input may have, and the report of two episodes of the hopper.
    fn health(arguments: &[&str]) -> (f64, Value) {
        let file = champion("hopper-b23");
        let all = ["eval", text(&file), "--episodes", "2", "--seed", "9"];
        let report = tpg_json(&[&all, arguments, &["--health", "--json"]].concat());
        let threshold = report["health"]["threshold"].as_f64().expect("a number");
        (threshold, report)
    }

    /// The worst share of each episode.
    fn worst(report: &Value, input: u64) -> Vec<f64> {
        let channels = report["health"]["channels"].as_array().expect("a list");
        let channel = channels.iter().find(|channel| channel["input"] == input);
        let episodes = channel.expect("it is watched")["worst"].as_array();
        let number = |share: &Value| share.as_f64().unwrap_or_else(|| panic!("{report}"));
        episodes.expect("a list").iter().map(number).collect()
    }

    #[test]
    fn healthy_sensors_are_not_suspect_and_nothing_else_changes() {
        for sight in ["blackout:2/3", "none"] {
            let arguments = ["--observability", sight];
            let (threshold, report) = health(&arguments);
            for input in 0..11 {
                for share in worst(&report, input) {
                    assert!(share < threshold, "{sight}, input {input}: {share}");
                }
            }
            let file = champion("hopper-b23");
            let plain = [
                "eval",
                text(&file),
                "--episodes",
                "2",
                "--seed",
                "9",
                "--json",
            ];
            let plain = tpg_json(&[&plain[..], &arguments].concat());
            assert_eq!(plain["returns"], report["returns"]);
            assert_eq!(plain["health"], Value::Null);
        }
    }

    #[test]
    fn a_stuck_sensor_is_suspect() {
        for (input, name) in [
            (0, "torso_height"),
            (3, "leg_angle"),
            (4, "foot_angle"),
            (7, "torso_angular_velocity"),
            (9, "leg_angular_velocity"),
        ] {
            let fault = format!("at 1s stuck:{name} for 10s");
            let (threshold, report) = health(&["--observability", "none", "--disturb", &fault]);
            for share in worst(&report, input) {
                assert!(share > threshold, "{name}: {share}");
            }
            let channels = report["health"]["channels"].as_array().expect("a list");
            assert_eq!(channels[input as usize]["name"], name);
            assert_eq!(channels[input as usize]["suspect"], 2, "{name}");
        }
    }

    #[test]
    fn the_table_names_the_channels() {
        let file = champion("hopper-b23");
        let output = tpg_ok(&["eval", text(&file), "--episodes", "1", "--health"]);
        let said = String::from_utf8_lossy(&output.stdout);
        for part in [
            "above 0.8 is suspect",
            " 10 foot_angular_velocity",
            "suspect in 0 of 1 episodes",
        ] {
            assert!(said.contains(part), "{said}");
        }
    }
}
