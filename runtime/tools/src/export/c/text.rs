//! Text that the header and the source share.

use super::super::plan::Plan;
use super::super::text::preamble;

/// The comment at the start of both files.
pub(super) fn comment(plan: &Plan<'_>, command: &str, more: &[String]) -> String {
    let lines = preamble(plan, command);
    let mut text = String::new();
    let mut start = "/*";
    for line in lines.iter().chain(more) {
        let line = format!("{start} {}", line.replace("*/", "* /"));
        text.push_str(line.trim_end());
        text.push('\n');
        start = " *";
    }
    text + " */\n"
}

/// The head of the function that decides.
pub(super) fn signature(plan: &Plan<'_>, name: &str) -> String {
    let upper = name.to_uppercase();
    if plan.outputs > 0 {
        format!(
            "void {name}_decide({name} *self, const float observation[{upper}_INPUTS], float action[{upper}_OUTPUTS])"
        )
    } else {
        format!("uint16_t {name}_decide({name} *self, const float observation[{upper}_INPUTS])")
    }
}
