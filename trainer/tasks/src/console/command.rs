//! Commands that a message shows, to be pasted into a shell.

/// Joins words to a command line for a POSIX shell; words with other than plain characters are quoted.
///
/// # Examples
/// ```
/// use tpg_tasks::console::command_line;
/// assert_eq!(command_line(["tpg", "eval", "my runs/a.tpg"]), "tpg eval 'my runs/a.tpg'");
/// ```
#[must_use]
pub fn command_line<S: AsRef<str>>(words: impl IntoIterator<Item = S>) -> String {
    let words: Vec<String> = words
        .into_iter()
        .map(|word| quoted(word.as_ref()))
        .collect();
    words.join(" ")
}

/// The word as a POSIX shell reads it back.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_words_back() {
        let words = [
            "a b",
            "",
            "it's",
            "$HOME",
            "a;b",
            "*",
            "~",
            "plain/1.0-x_y",
            "\"",
            "é",
        ];
        let script = format!("printf '%s\\n' {}", command_line(words));
        let output = std::process::Command::new("sh")
            .args(["-c", &script])
            .output();
        let printed = String::from_utf8(output.expect("a shell").stdout).expect("text");
        assert_eq!(printed.lines().collect::<Vec<_>>(), words);
    }
}
