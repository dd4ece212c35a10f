//! What the pages have in common that programs write: one HTML file each, with everything in it.

use serde::Serialize;

/// Colours and text of every page, in the light and in the dark.
const STYLE: &str = include_str!("page/page.css");

/// Puts together a page that needs no other file: a style, what is seen before any script runs, data, and scripts in order.
///
/// Scripts find the data as the constant `DATA`. It cannot leave its place, whatever its texts hold.
///
/// # Errors
/// Where the data has no form in JSON.
pub fn page(
    style: &str,
    body: &str,
    data: &impl Serialize,
    scripts: &[&str],
) -> Result<String, serde_json::Error> {
    // `<` begins everything that HTML would take for an end of the script.
    let data = serde_json::to_string(data)?.replace('<', "\\u003c");
    let scripts = scripts.concat();
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<title>tpg</title>\n\
         <style>\n{STYLE}{style}</style>\n{body}\
         <script type=\"application/json\" id=\"data\">{data}</script>\n\
         <script>\n'use strict';\nconst DATA = JSON.parse(document.getElementById('data').textContent);\n{scripts}</script>\n</html>\n"
    ))
}

/// Bytes as Base64, with padding.
#[must_use]
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |k: usize| u32::from(chunk.get(k).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= chunk.len() { digit.into() } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4648, section 10.
    #[test]
    fn base64_gives_the_examples_of_its_definition() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn data_cannot_end_its_script() {
        let page = page("", "", &"</script><script>alert(1)", &[]).unwrap();
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(page.contains(r#""\u003c/script>\u003cscript>alert(1)""#));
    }
}
