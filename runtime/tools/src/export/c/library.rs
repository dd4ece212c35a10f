//! Selects the library functions that a C module uses.

/// A function of a module, with the comment before it.
#[derive(Debug, Clone)]
pub(super) struct Snippet {
    name: String,
    text: String,
}

impl Snippet {
    /// Creates a function and finds its name in its text. A comment may come before the function.
    pub(super) fn new(text: String) -> Self {
        let start = text.find("static ").unwrap_or(0);
        let head = text[start..].split('(').next().unwrap_or_default();
        let name = head.rsplit(|c: char| !is_word(c)).next();
        let name = name.unwrap_or_default().to_owned();
        Snippet { name, text }
    }

    /// The functions of a text, which are separated by empty lines.
    pub(super) fn split(text: &str) -> impl Iterator<Item = Snippet> {
        let blocks = text.trim().split("\n\n");
        blocks
            .map(|block| block.to_owned() + "\n")
            .map(Snippet::new)
    }
}

/// The functions of `library` that `body` needs, with an empty line before each. Functions call only earlier ones.
pub(super) fn used(library: Vec<Snippet>, body: &str) -> String {
    let mut kept: Vec<String> = Vec::new();
    for snippet in library.into_iter().rev() {
        let called = |text: &str| calls(text, &snippet.name);
        if called(body) || kept.iter().any(|text| called(text)) {
            kept.push(snippet.text);
        }
    }
    kept.iter().rev().map(|text| format!("\n{text}")).collect()
}

/// Whether a text has the name before a parenthesis.
fn calls(text: &str, name: &str) -> bool {
    let call = format!("{name}(");
    text.match_indices(&call)
        .any(|(at, _)| !text[..at].ends_with(is_word))
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_called_stays() {
        let text = "/* One (1). */\nstatic int one(int x) { return x; }\n\n\
                    static int two(int x) { return one(x); }\n\n\
                    static int other_two(int x) { return x; }\n";
        let library: Vec<Snippet> = Snippet::split(text).collect();
        let kept = used(library.clone(), "int f(void) { return two(1); }");
        assert!(kept.contains("int one(") && kept.contains("int two("));
        assert!(!kept.contains("other_two"), "{kept}");
        assert_eq!(used(library, "int f(void) { return another_one(1); }"), "");
    }
}
