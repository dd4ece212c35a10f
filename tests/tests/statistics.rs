//! The report's statistics against SciPy's, as `scripts/statistics-golden.py` wrote them down.

use serde::Deserialize;
use tpg_tasks::stats::{bootstrap_mean_95, holm, mann_whitney};

#[derive(Deserialize)]
struct Golden {
    mann_whitney: Vec<Test>,
    holm: Vec<Corrected>,
    bootstrap: Vec<Interval>,
}

#[derive(Deserialize)]
struct Test {
    a: Vec<f64>,
    b: Vec<f64>,
    method: String,
    u: f64,
    p: f64,
}

#[derive(Deserialize)]
struct Corrected {
    p: Vec<f64>,
    corrected: Vec<f64>,
}

#[derive(Deserialize)]
struct Interval {
    values: Vec<f64>,
    low: f64,
    high: f64,
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("../golden/statistics.json")).expect("the script's JSON")
}

#[test]
fn mann_whitney_agrees_with_scipy() {
    for (case, expected) in golden().mann_whitney.iter().enumerate() {
        let test = mann_whitney(&expected.a, &expected.b).expect("samples");
        assert_eq!(test.exact, expected.method == "exact", "case {case}");
        assert!((test.u - expected.u).abs() < 1e-12, "case {case}");
        // Relative: a p of 1e-34 must be right too.
        assert!(
            (test.p - expected.p).abs() <= 1e-9 * expected.p,
            "case {case}: {} against {}",
            test.p,
            expected.p
        );
        let pairs = (expected.a.len() * expected.b.len()) as f64;
        assert!((test.delta - (2.0 * expected.u / pairs - 1.0)).abs() < 1e-12);
    }
}

#[test]
fn holm_agrees_with_the_procedure_step_by_step() {
    for expected in golden().holm {
        for (ours, theirs) in holm(&expected.p).iter().zip(&expected.corrected) {
            assert!((ours - theirs).abs() < 1e-12, "{:?}", expected.p);
        }
    }
}

/// Our ten thousand resamples against a million of SciPy's: the ends agree to a twentieth of the interval.
#[test]
fn the_bootstrap_agrees_with_scipy() {
    for expected in golden().bootstrap {
        let [low, high] = bootstrap_mean_95(&expected.values);
        let width = expected.high - expected.low;
        assert!((low - expected.low).abs() < 0.05 * width, "{low}");
        assert!((high - expected.high).abs() < 0.05 * width, "{high}");
    }
}
