//! The graph as a drawing: a card for each team, a row for each of its programs.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;

use tpg_runtime::Policy;
use tpg_runtime::blob::ActionKind;
use tpg_runtime::tables::{ProgramId, Target, TeamId};

use super::names::{inputs_used, output_name};
use super::program_text;

/// How often a program won in a team, by the numbers of team and program.
pub type Wins = BTreeMap<(u16, u16), u64>;

/// Sizes in pixels.
const CARD: usize = 400;
const GAP: usize = 40;
const HEAD: usize = 34;
const ROW: usize = 44;
/// Cards beside each other: a drawing is never wider, whatever the policy.
const COLUMNS: usize = 3;
/// Characters of the line of inputs that fit on a card.
const LINE: usize = 56;
/// Colours of actions, told apart on paper too (ColorBrewer, Set3).
const COLOURS: [&str; 8] = [
    "#8dd3c7", "#ffffb3", "#bebada", "#fb8072", "#80b1d3", "#fdb462", "#b3de69", "#fccde5",
];
const STYLE: &str = "text{font:13px sans-serif;fill:#222}.s{font-size:11px;fill:#666}.h{font-weight:bold}\
    .c{fill:#fff;stroke:#888}.r{stroke:#ddd}.w{fill:#4477aa}.e{fill:none;stroke:#666;stroke-width:1.5;opacity:.6}";

/// A card with its place.
struct Card {
    team: u16,
    /// Programs, those that win most often first.
    programs: Vec<u16>,
    x: usize,
    y: usize,
}

impl Card {
    fn height(&self) -> usize {
        HEAD + ROW * self.programs.len()
    }
}

/// Draws a policy's graph as SVG: teams from the root on, and below each other those that lie deeper.
///
/// A row has a program's length and inputs, and where it leads: an action in its colour, or a team, to which an edge goes. Who
/// points at a row sees its instructions. With `wins`, rows are sorted by them and have bars.
#[must_use]
pub fn svg(policy: &Policy<'_>, wins: Option<&Wins>) -> String {
    let cards = cards(policy, wins);
    let right = cards.iter().map(|card| card.x + CARD + GAP).max();
    let bottom = cards.iter().map(|card| card.y + card.height() + GAP).max();
    let (width, height) = (right.unwrap_or(GAP), bottom.unwrap_or(GAP));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\
         <style>{STYLE}</style>\
         <defs><marker id=\"a\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"8\" markerHeight=\"8\" orient=\"auto\">\
         <path d=\"M0 0L8 4L0 8z\" fill=\"#666\"/></marker></defs>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#f6f6f6\"/>\n"
    );
    let places: BTreeMap<u16, (usize, usize)> = cards
        .iter()
        .map(|card| (card.team, (card.x, card.y)))
        .collect();
    // Edges lie behind the cards, so that they cross no text.
    let (mut edges, mut rows) = (String::new(), String::new());
    for card in &cards {
        // Writing to a string cannot fail.
        let _ = write_card(&mut rows, &mut edges, policy, card, wins, &places);
    }
    out += &edges;
    out += &rows;
    out + "</svg>\n"
}

/// Every team that the root reaches, placed in rows: a depth begins a row of its own.
fn cards(policy: &Policy<'_>, wins: Option<&Wins>) -> Vec<Card> {
    let tables = policy.tables();
    let (mut seen, mut queue) = (BTreeSet::from([0]), VecDeque::from([(0, 0)]));
    let (mut cards, mut depth_so_far): (Vec<Card>, usize) = (Vec::new(), 0);
    let (mut column, mut top, mut bottom) = (0, GAP, GAP);
    while let Some((number, depth)) = queue.pop_front() {
        let Some(team) = tables.team(TeamId(number)) else {
            continue;
        };
        let mut programs: Vec<u16> = tables.members(&team).map(|program| program.0).collect();
        if let Some(wins) = wins {
            let count = |program: &u16| wins.get(&(number, *program)).copied().unwrap_or(0);
            programs.sort_by_key(|program| std::cmp::Reverse(count(program)));
        }
        for program in tables.members(&team) {
            if let Some(Target::Team(TeamId(next))) = tables.program(program).map(|p| p.target)
                && seen.insert(next)
            {
                queue.push_back((next, depth + 1));
            }
        }
        if column == COLUMNS || depth != depth_so_far {
            (column, top) = (0, bottom + GAP);
        }
        let card = Card {
            team: number,
            programs,
            x: GAP + column * (CARD + GAP),
            y: top,
        };
        bottom = bottom.max(top + card.height());
        (column, depth_so_far) = (column + 1, depth);
        cards.push(card);
    }
    cards
}

fn write_card(
    out: &mut String,
    edges: &mut String,
    policy: &Policy<'_>,
    card: &Card,
    wins: Option<&Wins>,
    places: &BTreeMap<u16, (usize, usize)>,
) -> std::fmt::Result {
    let (x, y, team) = (card.x, card.y, card.team);
    let root = if team == 0 { " (root)" } else { "" };
    let count = |program: u16| wins.map(|wins| wins.get(&(team, program)).copied().unwrap_or(0));
    let all: u64 = card.programs.iter().filter_map(|p| count(*p)).sum();
    let decided = wins.map_or_else(String::new, |_| format!(", {all} wins"));
    writeln!(
        out,
        "<rect class=\"c\" x=\"{x}\" y=\"{y}\" width=\"{CARD}\" height=\"{}\" rx=\"6\"/>\
         <text class=\"h\" x=\"{}\" y=\"{}\">team {team}{root}</text>\
         <text class=\"s\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{} programs{decided}</text>",
        card.height(),
        x + 12,
        y + 22,
        x + CARD - 12,
        y + 22,
        card.programs.len(),
    )?;
    for (row, number) in card.programs.iter().enumerate() {
        let Some(program) = policy.tables().program(ProgramId(*number)) else {
            continue;
        };
        let y = y + HEAD + row * ROW;
        let share = count(*number).map(|wins| wins as f64 / all.max(1) as f64);
        let percent = share.map_or_else(String::new, |share| {
            format!(", wins {:.1} %", 100.0 * share)
        });
        let inputs = inputs(&inputs_used(policy, policy.tables().code(&program)));
        let plural = if program.code_len == 1 { "" } else { "s" };
        writeln!(
            out,
            "<g><title>{}</title><path class=\"r\" d=\"M{x} {y}h{CARD}\"/>\
             <text x=\"{}\" y=\"{}\">program {number}: {} instruction{plural}{percent}</text>\
             <text class=\"s\" x=\"{}\" y=\"{}\">{}</text>",
            escaped(&program_text(policy, *number)),
            x + 12,
            y + 18,
            program.code_len,
            x + 12,
            y + 35,
            escaped(&inputs),
        )?;
        if let Some(share) = share {
            let length = (share * (CARD - 24) as f64).round();
            let (left, below) = (x + 12, y + ROW - 4);
            writeln!(
                out,
                "<rect class=\"w\" x=\"{left}\" y=\"{below}\" width=\"{length}\" height=\"3\"/>"
            )?;
        }
        let (label, colour) = chip(policy, program.target);
        let wide = 14 + 7 * label.chars().count();
        let left = x + CARD - 12 - wide;
        writeln!(
            out,
            "<rect x=\"{left}\" y=\"{}\" width=\"{wide}\" height=\"20\" rx=\"10\" fill=\"{colour}\" stroke=\"#888\"/>\
             <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text></g>",
            y + 4,
            left + wide / 2,
            y + 18,
            escaped(&label),
        )?;
        if let Target::Team(TeamId(next)) = program.target
            && let Some((to_x, to_y)) = places.get(&next)
        {
            let (from_x, from_y) = (x + CARD, y + 14);
            let (to_x, bend) = (to_x + CARD / 2, from_x + GAP);
            writeln!(
                edges,
                "<path class=\"e\" marker-end=\"url(#a)\" d=\"M{from_x} {from_y}C{bend} {from_y} {to_x} {} {to_x} {to_y}\"/>",
                to_y.saturating_sub(GAP),
            )?;
        }
    }
    Ok(())
}

/// What stands on a chip, and its colour: one for each action or output, white for a team.
fn chip(policy: &Policy<'_>, target: Target) -> (String, &'static str) {
    let (label, number) = match target {
        Target::Team(TeamId(team)) => return (format!("team {team}"), "#ffffff"),
        Target::Atomic(action) => match policy.header().action_kind {
            ActionKind::Discrete => (format!("action {action}"), action),
            ActionKind::Continuous => ("action".to_owned(), 0),
            _ => (output_name(policy, action), action),
        },
    };
    (label, COLOURS[usize::from(number) % COLOURS.len()])
}

/// As many names as fit on a card, and how many more there are.
fn inputs(names: &[String]) -> String {
    if names.is_empty() {
        return "no inputs".to_owned();
    }
    let mut line = String::new();
    for (k, name) in names.iter().enumerate() {
        let more = format!(", and {} more", names.len() - k);
        let next = if k == 0 {
            name.clone()
        } else {
            format!(", {name}")
        };
        if k > 0 && line.chars().count() + next.chars().count() + more.len() > LINE {
            return line + &more;
        }
        line += &next;
    }
    line
}

/// A text inside an XML element.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_of_inputs_are_cut() {
        let names: Vec<String> = (0..30)
            .map(|k| format!("some_joint_velocity_{k}"))
            .collect();
        let line = inputs(&names);
        assert!(
            line.chars().count() <= LINE && line.ends_with(" more"),
            "{line}"
        );
        assert_eq!(inputs(&names[..1]), names[0]);
        assert_eq!(inputs(&[]), "no inputs");
    }
}
