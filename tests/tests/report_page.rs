//! `report.html` of runs and experiments: a browser draws what the tables hold.

use std::path::Path;

use serde_json::Value;
use tpg_tests::browser::{Browser, Loaded};
use tpg_tests::process::{text, tpg_ok};

/// The state that a page tells scripts, after checks that hold for every page.
fn state(loaded: &Loaded) -> Value {
    assert_eq!(loaded.console, [""; 0], "the console is silent");
    serde_json::from_str(&loaded.text_of("state")).expect("a state")
}

fn chart<'a>(state: &'a Value, title: &str) -> &'a Value {
    let mut charts = state["charts"].as_array().expect("charts").iter();
    charts
        .find(|chart| chart["title"] == title)
        .expect("the chart")
}

/// The rows of a run's log, each column by its name.
fn log(run: &Path) -> Vec<Vec<(String, f64)>> {
    let text = std::fs::read_to_string(run.join("log.csv")).expect("a log");
    let mut lines = text.lines();
    let names: Vec<String> = lines
        .next()
        .expect("names")
        .split(',')
        .map(str::to_owned)
        .collect();
    let row = |line: &str| {
        let values = line
            .split(',')
            .map(|field| field.parse().unwrap_or(f64::NAN));
        names.iter().cloned().zip(values).collect()
    };
    lines.map(row).collect()
}

fn column(row: &[(String, f64)], name: &str) -> f64 {
    row.iter()
        .find(|(column, _)| column == name)
        .expect("the column")
        .1
}

fn assert_near(found: &Value, expected: f64) {
    let found = found.as_f64().expect("a number");
    // Numbers have six digits.
    assert!(
        (found - expected).abs() <= 1e-5 * expected.abs(),
        "{found} {expected}"
    );
}

#[test]
fn the_page_of_a_run_draws_its_log_and_goes_on_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("run");
    let small = [
        "--set",
        "evolution.population=20",
        "--checkpoint-every",
        "0",
    ];
    let train = [
        "train",
        "cartpole-sr-sm",
        "--generations",
        "3",
        "--out",
        text(&run),
    ];
    tpg_ok(&[&train[..], &small].concat());
    tpg_ok(&["train", "--resume", text(&run), "--generations", "5"]);
    let page = run.join("report.html");
    let html = std::fs::read_to_string(&page).expect("a page");
    assert!(html.len() < 60_000, "{} bytes", html.len());
    assert!(
        !html.contains("http://") && !html.contains("https://"),
        "it needs no network"
    );
    let Some(browser) = Browser::find() else {
        return;
    };
    let rows = log(&run);
    assert_eq!(rows.len(), 5);
    for (axis, scale) in [
        ("steps", 1.0),
        ("generations", 1.0),
        ("minutes", 1.0 / 60.0),
    ] {
        let state = state(&browser.load(&page, &format!("axis={axis}")));
        assert_eq!(state["axis"], axis);
        let score = chart(&state, "score");
        assert!(
            score["inked"].as_u64() > Some(500),
            "an empty canvas: {score}"
        );
        let best = &score["series"][0];
        assert_eq!(best["points"], 5);
        let name = match axis {
            "generations" => "generation",
            "minutes" => "seconds",
            other => other,
        };
        for (point, row) in [("first", &rows[0]), ("last", &rows[4])] {
            assert_near(&best[point]["x"], scale * column(row, name));
            assert_near(&best[point]["y"], column(row, "best"));
        }
        // Cartpole's presets hold no races.
        assert_eq!(score["series"][1]["points"], 0);
        assert_near(&score["series"][2]["last"]["y"], column(&rows[4], "mean"));
    }
    let dom = browser.load(&page, "").dom;
    for word in [
        "evolution.population",
        "cartpole-sr-sm",
        "champion.tpg",
        "at most for a decision",
    ] {
        assert!(dom.contains(word), "{word}");
    }
}

#[test]
fn the_page_of_an_experiment_draws_means_and_bands() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("small.toml");
    let experiment = r#"
        name = "small"
        tasks = ["cartpole"]
        variants = ["per-agent", "original"]
        repeats = 2
        test-episodes = 3
        budget = { generations = 4 }
        [set]
        evolution.population = 20
        evolution.children = 20
    "#;
    std::fs::write(&file, experiment).expect("written");
    tpg_ok(&["experiment", "run", text(&file)]);
    let results = folder.path().join("small");
    let page = results.join("report.html");
    assert!(page.is_file());
    let Some(browser) = Browser::find() else {
        return;
    };
    let state = state(&browser.load(&page, "axis=generations"));
    let chart = chart(&state, "cartpole: training score");
    assert!(chart["inked"].as_u64() > Some(500), "{chart}");
    for (k, variant) in ["per-agent", "original"].into_iter().enumerate() {
        let series = &chart["series"][k];
        assert_eq!(series["label"], variant);
        let last = |repeat: u32| {
            let path = results.join(format!("curves/cartpole.{variant}.{repeat}.csv"));
            let text = std::fs::read_to_string(path).expect("a curve");
            let column = text
                .lines()
                .next()
                .expect("names")
                .split(',')
                .position(|name| name == "best");
            let line = text.lines().last().expect("a row");
            let field = line
                .split(',')
                .nth(column.expect("the column"))
                .expect("a value");
            field.parse::<f64>().expect("a number")
        };
        let (a, b) = (last(1), last(2));
        let end = &series["last"];
        assert_near(&end["x"], 4.0);
        assert_near(&end["y"], (a + b) / 2.0);
        assert_near(&end["low"], a.min(b));
        assert_near(&end["high"], a.max(b));
    }
    let dom = browser.load(&page, "").dom;
    assert!(dom.contains("4 of 4 runs"), "how many runs there are");
}
