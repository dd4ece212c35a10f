//! A configuration as a file that explains itself.

use toml::{Table, Value};

use super::layers::default_table;
use super::preset::DEFAULTS;
use super::schema::Config;

/// Every key of a configuration as TOML, each below its meaning, and below its default where that is another. `--config` takes
/// the text.
#[must_use]
pub fn documented(config: &Config) -> String {
    let here = Table::try_from(config).unwrap_or_default();
    let defaults = default_table();
    let mut section: Vec<&str> = Vec::new();
    let mut text = String::new();
    // What the file of the defaults says of itself is its first paragraph.
    for line in DEFAULTS.lines().skip_while(|line| !line.is_empty()).skip(1) {
        if let Some(name) = line.strip_prefix('[') {
            section = name.trim_end_matches(']').split('.').collect();
        }
        let key = line.split_once(" = ").filter(|_| !line.starts_with('#'));
        let default = key.and_then(|(key, _)| find(&defaults, &section, key));
        let (Some((key, _)), Some(default)) = (key, default) else {
            text.push_str(line);
            text.push('\n');
            continue;
        };
        // A configuration leaves out parts that are as usual.
        let value = find(&here, &section, key).unwrap_or(default);
        let (value, default) = (value.to_string(), default.to_string());
        if value != default {
            text.push_str(&format!("# Default: {default}\n"));
        }
        text.push_str(&format!("{key} = {value}\n"));
    }
    text
}

fn find<'a>(table: &'a Table, section: &[&str], key: &str) -> Option<&'a Value> {
    let mut table = table;
    for name in section {
        table = table.get(*name)?.as_table()?;
    }
    table.get(key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Preset, leaves, presets, resolve};

    #[test]
    fn a_preset_can_be_read_back_from_what_explains_it() {
        for preset in presets().expect("presets") {
            let config = resolve(&preset, None, &[]).expect("valid");
            let text = documented(&config);
            // Below another preset, so that every key has to be there.
            let other = Preset::find("cartpole-original").expect("exists");
            let back = resolve(&other, Some(&text), &[]).expect("valid");
            assert_eq!(back, config, "{}", preset.name);
        }
    }

    #[test]
    fn every_key_has_a_meaning_and_a_default_where_it_is_another() {
        let preset = Preset::find("hopper-champion").expect("exists");
        let sets = ["evolution.population=77".to_owned()];
        let text = documented(&resolve(&preset, None, &sets).expect("valid"));
        assert!(
            text.contains("\n# Default: 1500\npopulation = 77\n"),
            "{text}"
        );
        let lines: Vec<&str> = text.lines().collect();
        for pair in lines.windows(2).filter(|pair| pair[1].contains(" = ")) {
            let (before, line) = (pair[0], pair[1]);
            assert!(line.starts_with('#') || before.starts_with('#'), "{line}");
        }
        let read: Table = text.parse().expect("TOML");
        assert_eq!(leaves(&read, "").len(), leaves(&default_table(), "").len());
    }
}
