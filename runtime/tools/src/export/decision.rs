//! Writes the statements of a decision, team by team, independent of the language.

use tpg_runtime::tables::{Target, TeamId};

use super::plan::{Function, Member, Plan, TeamPlan};

/// A program as it takes part in its team's decision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bidder {
    pub(super) program: u16,
    pub(super) function: Function,
    /// The number of instructions that one run counts as.
    pub(super) instructions: u16,
    /// Whether another team of the same decision may already have run it.
    pub(super) cached: bool,
    /// Whether it gives values of a continuous action.
    pub(super) acts: bool,
    /// The output that it gives, if each output has its own programs.
    pub(super) own_output: Option<u16>,
}

/// How a language writes the decision.
pub(super) trait WriteDecision {
    /// The number of spaces before a team's statements.
    const INDENT: usize;
    /// The text before a team's statements.
    fn open_team(&self, team: u16) -> String;
    /// The condition that a team was not visited, and the start of its block.
    fn unless_visited(&self, team: u16) -> String;
    /// Runs a program, and counts its instructions if `count` is set. A cached program runs only once.
    fn run(&self, bidder: &Bidder, count: bool) -> Vec<String>;
    /// Compares a program's bid with the best so far.
    fn compare(&self, bidder: &Bidder) -> Vec<String>;
    /// Continues with the next team. `next` holds pairs of winner and team.
    fn close_team(&self, next: &[(u16, u16)]) -> String;
}

/// Writes what each team does in a decision.
pub(super) fn write_teams<L: WriteDecision>(out: &mut String, plan: &Plan<'_>, language: &L) {
    for (number, team) in plan.reached() {
        write_team(out, plan, language, number, team);
    }
}

fn write_team<L: WriteDecision>(
    out: &mut String,
    plan: &Plan<'_>,
    language: &L,
    number: u16,
    team: &TeamPlan,
) {
    out.push_str(&language.open_team(number));
    let mut line = |depth: usize, text: &str| {
        let pad = L::INDENT + 4 * depth;
        out.push_str(&format!("{:pad$}{text}\n", ""));
    };
    if plan.marked.contains(&number) {
        line(0, &format!("visited_{number} = true;"));
    }
    let always = |m: &&Member| m.unless_visited.is_none() && !plan.cached.contains(&m.program);
    let certain = team.members.iter().filter(always);
    let certain: u32 = certain
        .map(|m| u32::from(plan.program(m.program).code_len))
        .sum();
    line(0, &format!("instructions += {certain};"));
    for member in &team.members {
        let bidder = bidder(plan, number, member.program);
        let depth = usize::from(member.unless_visited.is_some());
        if let Some(next) = member.unless_visited {
            line(0, &language.unless_visited(next));
        }
        let count = bidder.cached || member.unless_visited.is_some();
        let lines = language.run(&bidder, count).into_iter();
        for text in lines.chain(language.compare(&bidder)) {
            line(depth, &text);
        }
        if member.unless_visited.is_some() {
            line(0, "}");
        }
    }
    let next = |m: &Member| match plan.program(m.program).target {
        Target::Team(TeamId(next)) => Some((m.program, next)),
        Target::Atomic(_) => None,
    };
    let next: Vec<(u16, u16)> = team.members.iter().filter_map(next).collect();
    out.push_str(&language.close_team(&next));
}

fn bidder(plan: &Plan<'_>, team: u16, program: u16) -> Bidder {
    Bidder {
        program,
        function: plan.function(program, team),
        instructions: plan.program(program).code_len,
        cached: plan.cached.contains(&program),
        acts: plan.acts(program),
        own_output: plan.own_output(program),
    }
}
