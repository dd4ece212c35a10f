//! What a configuration's keys take: bounds of numbers, names of enumerated values, and what is left out when written.

use serde::{Deserialize as _, Deserializer, Serializer, de, ser::SerializeSeq as _};
use toml::Value;

/// A key of a table and the values that it takes.
pub(crate) struct Key {
    /// The key's name within its table.
    pub name: &'static str,
    /// What it takes.
    pub values: Values,
}

/// The values that a key takes.
#[derive(Clone, Copy)]
pub(crate) enum Values {
    /// `true` or `false`.
    Flag,
    /// Any text.
    Text,
    /// A whole number, both bounds included.
    Whole {
        /// Smallest value.
        min: u64,
        /// Largest value.
        max: u64,
    },
    /// A finite number, both bounds included.
    Number {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// One of these names.
    Name(fn() -> Vec<&'static str>),
    /// A list of these names.
    Names(fn() -> Vec<&'static str>),
    /// A list of texts, each of which this function accepts or refuses with a reason.
    Texts(fn(&str) -> Result<(), String>),
    /// A list of texts, or this word in its place.
    TextsOr(&'static str),
    /// A table of keys.
    Table(&'static [Key]),
}

impl Key {
    /// A key that takes `true` or `false`.
    pub(crate) const fn flag(name: &'static str) -> Self {
        Self::new(name, Values::Flag)
    }

    /// A key that takes a whole number within these bounds, both included.
    pub(crate) const fn whole(name: &'static str, min: u64, max: u64) -> Self {
        Self::new(name, Values::Whole { min, max })
    }

    /// A key that takes a number within these bounds, both included.
    pub(crate) const fn number(name: &'static str, min: f64, max: f64) -> Self {
        Self::new(name, Values::Number { min, max })
    }

    /// A key that takes a probability.
    pub(crate) const fn rate(name: &'static str) -> Self {
        Self::number(name, 0.0, 1.0)
    }

    /// A key that takes the name of a value of this type.
    pub(crate) const fn name<T: Named>(name: &'static str) -> Self {
        Self::new(name, Values::Name(names::<T>))
    }

    /// A key that takes a list of names of values of this type.
    pub(crate) const fn names<T: Named>(name: &'static str) -> Self {
        Self::new(name, Values::Names(names::<T>))
    }

    /// A key that takes a table of these keys.
    pub(crate) const fn table(name: &'static str, keys: &'static [Key]) -> Self {
        Self::new(name, Values::Table(keys))
    }

    /// A key that takes these values.
    pub(crate) const fn new(name: &'static str, values: Values) -> Self {
        Key { name, values }
    }
}

impl Values {
    /// Why these values do not include this one, and what they are; `None` if they do.
    pub(crate) fn refuse(&self, value: &Value) -> Option<String> {
        let right = match (*self, value) {
            (Values::Flag, Value::Boolean(_)) | (Values::Text, Value::String(_)) => true,
            (Values::Whole { min, max }, Value::Integer(number)) => {
                u64::try_from(*number).is_ok_and(|number| (min..=max).contains(&number))
            }
            (Values::Number { min, max }, Value::Integer(number)) => {
                (min..=max).contains(&(*number as f64))
            }
            // Neither infinities nor NaN lie within finite bounds.
            (Values::Number { min, max }, Value::Float(number)) => (min..=max).contains(number),
            (Values::Name(names), Value::String(name)) => return unknown_name(name, &names()),
            (Values::Names(names), Value::Array(list)) => {
                let names = names();
                return refuse_text(list, |name| unknown_name(name, &names));
            }
            (Values::Texts(check), Value::Array(list)) => {
                return refuse_text(list, |text| check(text).err());
            }
            (Values::TextsOr(_), Value::Array(list)) => return refuse_text(list, |_| None),
            (Values::TextsOr(word), Value::String(text)) => word == text,
            (Values::Table(_), Value::Table(_)) => true,
            _ => return Some(format!("invalid type: {}", self.range())),
        };
        (!right).then(|| self.range())
    }

    /// The values in words, to follow a key and a value that is none of them.
    fn range(&self) -> String {
        match *self {
            Values::Flag => "must be true or false".into(),
            Values::Text => "must be a text".into(),
            Values::Whole { min, max } => {
                format!("must be a whole number, at least {min} and at most {max}")
            }
            Values::Number { min, max } => format!("must be a number between {min} and {max}"),
            Values::Name(names) => format!("must be one of {}", names().join(", ")),
            Values::Names(names) => format!("must be a list of {}", names().join(", ")),
            Values::Texts(_) => "must be a list of texts".into(),
            Values::TextsOr(word) => format!("must be a list of texts, or {word:?}"),
            Values::Table(keys) => {
                let keys: Vec<&str> = keys.iter().map(|key| key.name).collect();
                format!("must be a table with the keys {}", keys.join(", "))
            }
        }
    }
}

/// The first reason for which a list is refused.
fn refuse_text(list: &[Value], refuse: impl Fn(&str) -> Option<String>) -> Option<String> {
    list.iter().find_map(|value| match value {
        Value::String(text) => refuse(text),
        other => Some(format!("invalid type: {other} must be a text")),
    })
}

fn unknown_name(name: &str, names: &[&str]) -> Option<String> {
    let all = names.join(", ");
    let suggestion = nearest(name, names.iter().copied());
    (!names.contains(&name))
        .then(|| format!("{name:?} is not one of {all}; did you mean {suggestion:?}?"))
}

/// The candidate that is spelled most like `name`; empty without candidates.
pub fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> String {
    candidates
        .map(|c| (strsim::jaro_winkler(name, c), c))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, c)| c.to_owned())
}

/// A type whose values have names in configurations.
pub(crate) trait Named: Copy + 'static {
    /// Every value.
    fn all() -> Vec<Self>;

    /// The value's name.
    fn name(self) -> &'static str;
}

/// The names of all values of a type.
pub(crate) fn names<T: Named>() -> Vec<&'static str> {
    T::all().into_iter().map(Named::name).collect()
}

/// Implements [`Named`] for a type that has `ALL` and `name`.
macro_rules! named {
    ($($type:ty)*) => {
        $(impl crate::keys::Named for $type {
            fn all() -> Vec<Self> {
                <$type>::ALL.to_vec()
            }

            fn name(self) -> &'static str {
                <$type>::name(self)
            }
        })*
    };
}
pub(crate) use named;

/// Writes and reads a value by its name.
pub(crate) mod by_name {
    use super::*;

    pub(crate) fn serialize<T: Named, S: Serializer>(
        value: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(value.name())
    }

    pub(crate) fn deserialize<'de, T: Named, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        let name = String::deserialize(deserializer)?;
        find(&name)
    }

    pub(super) fn find<T: Named, E: de::Error>(name: &str) -> Result<T, E> {
        let found = T::all().into_iter().find(|value| value.name() == name);
        found.ok_or_else(|| {
            let reason = unknown_name(name, &names::<T>());
            E::custom(reason.unwrap_or_default())
        })
    }
}

/// Writes and reads a list of values by their names.
pub(crate) mod by_names {
    use super::*;

    pub(crate) fn serialize<T: Named, S: Serializer>(
        values: &[T],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut list = serializer.serialize_seq(Some(values.len()))?;
        for value in values {
            list.serialize_element(value.name())?;
        }
        list.end()
    }

    pub(crate) fn deserialize<'de, T: Named, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<T>, D::Error> {
        let names = Vec::<String>::deserialize(deserializer)?;
        names.iter().map(|name| by_name::find(name)).collect()
    }
}

/// Whether a setting has its type's default. Such settings are left out of written configurations if the thesis does not
/// know them.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
