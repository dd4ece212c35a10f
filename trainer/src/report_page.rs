//! The page that a folder of results shows of itself: curves, tables, settings. One HTML file that needs no other.
//!
//! A page is data for one script, which draws it: [`Page`] says what there is. Curves may be seen over steps, generations and
//! minutes; several runs of one kind become a mean and a band.

use std::path::Path;

use serde::Serialize;
use toml::{Table as Toml, Value};

use crate::config::{Config, default_table, leaves};
use crate::files;
use tpg_tasks::page::page;

const STYLE: &str = include_str!("report_page/report.css");
const BODY: &str = include_str!("report_page/report.html");
const SCRIPTS: [&str; 2] = [
    include_str!("report_page/chart.js"),
    include_str!("report_page/report.js"),
];

/// What a page shows, in the order of the page.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Page {
    /// Its heading.
    pub title: String,
    /// What stands below it, each as a name and a value.
    pub facts: Vec<[String; 2]>,
    /// The runs that the charts draw.
    pub runs: Vec<Run>,
    /// Charts.
    pub charts: Vec<Chart>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Settings.
    pub settings: Vec<Setting>,
    /// Files beside the page.
    pub links: Vec<Link>,
}

/// A run's numbers over time. All lists have the same length.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Run {
    /// What runs that differ in their seed alone have in common.
    pub group: String,
    /// Generations completed.
    pub generations: Vec<u64>,
    /// Environment steps so far.
    pub steps: Vec<u64>,
    /// Minutes of training so far.
    pub minutes: Vec<f64>,
    /// The numbers by name, of few digits each; infinite ones and those that are missing are `null`.
    pub columns: Vec<(&'static str, Vec<Option<f64>>)>,
}

/// A chart: a heading, and curves.
#[derive(Debug, Clone, Serialize)]
pub struct Chart {
    /// Its heading.
    pub title: String,
    /// What has to be known to read it; may be empty.
    pub note: String,
    /// Its curves.
    pub series: Vec<Series>,
}

/// A curve: a column of the runs of a group.
#[derive(Debug, Clone, Serialize)]
pub struct Series {
    /// What it is called.
    pub label: String,
    /// The group.
    pub group: String,
    /// The column.
    pub column: &'static str,
}

/// A table of texts.
#[derive(Debug, Clone, Serialize)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// The names of its columns.
    pub head: Vec<String>,
    /// Its rows, each as long as `head`.
    pub rows: Vec<Vec<String>>,
}

/// A setting and its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// The path of its key.
    pub key: String,
    /// Its value as TOML.
    pub value: String,
    /// The default, where that is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
}

/// A file beside the page.
#[derive(Debug, Clone, Serialize)]
pub struct Link {
    /// What it is.
    pub label: String,
    /// Its path from the page.
    pub path: String,
}

impl Page {
    /// The HTML file.
    ///
    /// # Errors
    /// None that can occur: all of it has a form in JSON.
    pub fn html(&self) -> std::io::Result<String> {
        Ok(page(STYLE, BODY, self, &SCRIPTS)?)
    }

    /// Replaces a file by the page, as a whole.
    ///
    /// # Errors
    /// The file system's.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        files::replace(path, &[self.html()?.as_bytes()])
    }
}

/// Every setting of a configuration, beside the default where that is another.
#[must_use]
pub fn settings(config: &Config) -> Vec<Setting> {
    let (here, defaults) = (Toml::try_from(config).unwrap_or_default(), default_table());
    let (here, defaults) = (leaves(&here, ""), leaves(&defaults, ""));
    let find = |values: &[(String, &Value)], key: &str| {
        let found = values.iter().find(|(name, _)| name == key);
        found.map(|(_, value)| value.to_string())
    };
    let setting = |(key, value): &(String, &Value)| Setting {
        key: key.clone(),
        value: value.to_string(),
        default: find(&defaults, key).filter(|default| *default != value.to_string()),
    };
    // A configuration leaves out parts that are as usual.
    let usual = defaults.iter();
    let usual = usual.filter(|(key, _)| find(&here, key).is_none());
    here.iter().chain(usual).map(setting).collect()
}

/// A number of six digits, so that a page stays small; `None` for what is not finite.
#[must_use]
pub fn rounded(value: f64) -> Option<f64> {
    let short = format!("{value:.5e}").parse::<f64>();
    short.ok().filter(|short| short.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Preset, resolve};

    #[test]
    fn settings_name_the_default_where_it_is_another() {
        let preset = Preset::find("hopper-sr-sm-b23").unwrap();
        let config = resolve(&preset, None, &["evolution.population=77".into()]).unwrap();
        let settings = settings(&config);
        let find = |key: &str| {
            let mut settings = settings.iter();
            settings.find(|s| s.key == key).expect("the key").clone()
        };
        let population = find("evolution.population");
        assert_eq!(population.value, "77");
        assert!(population.default.is_some_and(|default| default != "77"));
        assert_eq!(find("tuning.lines").default, None);
        assert_eq!(find("task").value, "\"hopper-v4\"");
    }

    #[test]
    fn numbers_are_short_and_finite() {
        assert_eq!(rounded(1.0 / 3.0), Some(0.333_333));
        assert_eq!(rounded(-1_234_567.0), Some(-1_234_570.0));
        assert_eq!(rounded(0.0), Some(0.0));
        assert_eq!(rounded(f64::NEG_INFINITY), None);
        assert_eq!(rounded(f64::NAN), None);
    }

    #[test]
    fn an_empty_page_is_a_page() {
        let html = Page::default().html().unwrap();
        assert!(
            html.starts_with("<!doctype html>") && html.len() < 20_000,
            "{}",
            html.len()
        );
    }
}
