//! The text form of test vectors; `tests/golden/ops/README.md` describes it.

use std::collections::BTreeMap;

use tpg_runtime::isa::Op;

use super::Check;

/// One line of a file of vectors.
#[derive(Debug)]
pub struct Vector {
    /// The operation.
    pub op: Op,
    /// The line, counted from 1.
    pub line: usize,
    pub(super) fields: BTreeMap<String, String>,
    names: BTreeMap<String, Vec<f32>>,
    pub(super) expected: Expected,
}

#[derive(Debug)]
pub(super) enum Expected {
    Words(Vec<f32>),
    Near(f64, f64),
    Slots(Vec<usize>),
    Cells(Vec<Vec<usize>>),
}

/// Reads a file of vectors.
///
/// # Errors
/// The line that has another form.
pub fn parse(text: &str) -> Check<Vec<Vector>> {
    let mut names = BTreeMap::new();
    let mut vectors = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        let parsed = match content.split_once(' ') {
            None if content.is_empty() => Ok(()),
            Some(("let", rest)) => parse_name(rest).map(|(name, words)| {
                names.insert(name, words);
            }),
            _ => parse_vector(content, index + 1, &names).map(|vector| vectors.push(vector)),
        };
        parsed.map_err(|fault| format!("line {}: {fault}", index + 1))?;
    }
    Ok(vectors)
}

fn parse_name(text: &str) -> Check<(String, Vec<f32>)> {
    let (name, list) = text.split_once(' ').ok_or("a name without words")?;
    Ok((name.to_owned(), words(list)?))
}

fn words(list: &str) -> Check<Vec<f32>> {
    list.split(',')
        .map(|word| {
            let bits = u32::from_str_radix(word, 16).map_err(|e| format!("`{word}`: {e}"))?;
            Ok(f32::from_bits(bits))
        })
        .collect()
}

pub(super) fn numbers(list: &str) -> Check<Vec<usize>> {
    list.split(',')
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().map_err(|e| format!("`{n}`: {e}")))
        .collect()
}

fn parse_vector(text: &str, line: usize, names: &BTreeMap<String, Vec<f32>>) -> Check<Vector> {
    let (left, right) = text.split_once(" -> ").ok_or("no `->`")?;
    let mut parts = left.split(' ');
    let mnemonic = parts.next().unwrap_or_default();
    let op = Op::ALL.iter().find(|op| op.mnemonic() == mnemonic);
    let op = *op.ok_or_else(|| format!("no operation `{mnemonic}`"))?;
    let fields: BTreeMap<String, String> = parts
        .map(|part| part.split_once('=').ok_or("a field without `=`"))
        .map(|pair| pair.map(|(key, value)| (key.to_owned(), value.to_owned())))
        .collect::<Result<_, _>>()?;
    let named = fields
        .values()
        .chain([&right.to_owned()])
        .filter_map(|value| names.get(value).map(|words| (value.clone(), words.clone())))
        .collect();
    let expected = if let Some(list) = right.strip_prefix("slots ") {
        Expected::Slots(numbers(list)?)
    } else if let Some(list) = right.strip_prefix("cells ") {
        Expected::Cells(list.split(';').map(numbers).collect::<Check<_>>()?)
    } else if let Some((value, allowed)) = right.split_once(" +- ") {
        let number = |s: &str| s.parse::<f64>().map_err(|e| format!("`{s}`: {e}"));
        Expected::Near(number(value)?, number(allowed)?)
    } else if let Some(named) = names.get(right) {
        Expected::Words(named.clone())
    } else {
        Expected::Words(words(right)?)
    };
    Ok(Vector {
        op,
        line,
        fields,
        names: named,
        expected,
    })
}

impl Vector {
    pub(super) fn text(&self, key: &str) -> Check<&str> {
        let text = self.fields.get(key).map(String::as_str);
        text.ok_or_else(|| format!("no field `{key}`"))
    }

    pub(super) fn values(&self, key: &str) -> Check<Vec<f32>> {
        let text = self.text(key)?;
        self.names
            .get(text)
            .map_or_else(|| words(text), |named| Ok(named.clone()))
    }

    pub(super) fn number(&self, key: &str) -> Check<usize> {
        self.fields.get(key).map_or(Ok(0), |n| {
            n.parse().map_err(|e| format!("{key}=`{n}`: {e}"))
        })
    }

    pub(super) fn hex(&self, key: &str) -> Check<u64> {
        let text = self.text(key)?;
        u64::from_str_radix(text, 16).map_err(|e| format!("{key}=`{text}`: {e}"))
    }

    pub(super) fn width(&self) -> Check<usize> {
        Ok(self.number("w")?.max(1))
    }

    pub(super) fn kept_slots(&self) -> Check<[u8; 3]> {
        let masks = self.text("kept")?.split(',');
        let masks: Vec<u8> = masks
            .map(|mask| u8::from_str_radix(mask, 16).map_err(|e| format!("`{mask}`: {e}")))
            .collect::<Check<_>>()?;
        masks
            .try_into()
            .map_err(|_| "three masks wanted".to_owned())
    }
}
