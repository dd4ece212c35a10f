//! `tpg inspect --svg`: a drawing that can be looked at, whatever the policy.

use std::collections::BTreeMap;
use std::path::Path;

use roxmltree::{Document, Node};
use serde_json::Value;
use tpg_runtime::Policy;
use tpg_runtime::tables::{ProgramId, Target, TeamId};
use tpg_tests::graphs;
use tpg_tests::process::{stderr, text, tpg, tpg_ok};
use tpg_tools::disassemble::svg;

/// Most pixels from left to right.
const WIDEST: f64 = 1400.0;

fn number(node: Node<'_, '_>, name: &str) -> f64 {
    let value = node.attribute(name).expect("an attribute");
    value.parse().expect("a number")
}

/// The rectangles of a class, as left, top, right and bottom.
fn boxes(drawing: &Document<'_>, class: &str) -> Vec<[f64; 4]> {
    let nodes = drawing.descendants();
    let nodes = nodes.filter(|node| node.attribute("class") == Some(class));
    nodes
        .map(|node| {
            let [x, y, w, h] = ["x", "y", "width", "height"].map(|name| number(node, name));
            [x, y, x + w, y + h]
        })
        .collect()
}

/// The lines that name programs, from top to bottom of the file.
fn rows(drawing: &Document<'_>) -> Vec<String> {
    let texts = drawing.descendants().filter_map(|node| {
        let text = node.has_tag_name("text").then(|| node.text()).flatten()?;
        text.starts_with("program ").then(|| text.to_owned())
    });
    texts.collect()
}

#[test]
fn no_policy_is_too_wide_and_cards_do_not_overlap() {
    for (number_of, bytes) in graphs::all().iter().enumerate() {
        let policy = Policy::load(bytes).expect("a policy");
        let drawing = svg(&policy, None);
        let drawing = Document::parse(&drawing).expect("XML");
        let (width, height) = (
            number(drawing.root_element(), "width"),
            number(drawing.root_element(), "height"),
        );
        assert!(width <= WIDEST, "{number_of}: {width} pixels");
        let cards = boxes(&drawing, "c");
        for (k, [x, y, right, bottom]) in cards.iter().enumerate() {
            assert!(*right < width && *bottom < height, "{number_of}");
            for other in &cards[..k] {
                let apart =
                    x >= &other[2] || right <= &other[0] || y >= &other[3] || bottom <= &other[1];
                assert!(apart, "{number_of}: cards overlap");
            }
        }
        // Each team that the root reaches has a card, each member a row, each way to a team an edge.
        let (mut reached, mut next) = (vec![0], 0);
        let (mut members, mut ways) = (0, 0);
        while next < reached.len() {
            let team = policy.tables().team(TeamId(reached[next])).expect("a team");
            for ProgramId(program) in policy.tables().members(&team) {
                members += 1;
                let program = policy
                    .tables()
                    .program(ProgramId(program))
                    .expect("a program");
                if let Target::Team(TeamId(team)) = program.target {
                    ways += 1;
                    if !reached.contains(&team) {
                        reached.push(team);
                    }
                }
            }
            next += 1;
        }
        assert_eq!(cards.len(), reached.len(), "{number_of}");
        assert_eq!(rows(&drawing).len(), members, "{number_of}");
        let edges = drawing.descendants();
        let edges = edges.filter(|node| node.attribute("class") == Some("e"));
        assert_eq!(edges.count(), ways, "{number_of}");
    }
}

/// Rows are sorted by what a trace says, and their bars are as long as it says.
#[test]
fn a_trace_sorts_the_programs_by_how_often_they_win() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/champions");
    let policy = golden.join("hopper-sr-sm-b23.tpg");
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (trace, out) = (path("a.trace"), path("a.svg"));
    let (trace, out, policy) = (text(&trace), text(&out), text(&policy));
    tpg_ok(&["eval", policy, "--episodes", "3", "--trace", trace]);
    tpg_ok(&["inspect", policy, "--svg", out, "--trace", trace]);
    let mut wins: BTreeMap<u64, u64> = BTreeMap::new();
    for line in std::fs::read_to_string(trace).expect("a trace").lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        for visit in line["decision"]["path"].as_array().into_iter().flatten() {
            *wins
                .entry(visit["winner"].as_u64().expect("a number"))
                .or_default() += 1;
        }
    }
    let all: u64 = wins.values().sum();
    assert!(all > 10 && wins.len() > 1, "{wins:?}");
    let drawing = std::fs::read_to_string(out).expect("a drawing");
    let drawing = Document::parse(&drawing).expect("XML");
    let bars = boxes(&drawing, "w");
    let rows = rows(&drawing);
    assert_eq!(bars.len(), rows.len());
    let mut last = u64::MAX;
    for (row, bar) in rows.iter().zip(&bars) {
        let program = row["program ".len()..].split(':').next().expect("a number");
        let count = wins.get(&program.parse().expect("a number"));
        let count = count.copied().unwrap_or(0);
        assert!(count <= last, "{rows:?}");
        last = count;
        let share = 100.0 * count as f64 / all as f64;
        assert!(row.contains(&format!("{share:.1} %")), "{row}: {share}");
        let drawn = 100.0 * (bar[2] - bar[0]) / 376.0;
        assert!((drawn - share).abs() < 0.5, "{row}: a bar of {drawn} %");
    }
    let other = golden.join("pendulum-per-episode.tpg");
    let output = tpg(["inspect", text(&other), "--svg", out, "--trace", trace]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}
