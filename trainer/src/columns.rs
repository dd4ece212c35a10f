//! The columns of a table, taken from the struct of its rows.

use serde::de::{Deserialize, Deserializer, Error as _, Visitor, value};
use serde::forward_to_deserialize_any;

/// The names of a struct's fields as serde writes them, in order; none for other types.
#[must_use]
pub fn columns<'de, Row: Deserialize<'de>>() -> &'static [&'static str] {
    let mut fields: &'static [&'static str] = &[];
    // It never makes a value: the names are all that is asked of it.
    let _ = Row::deserialize(Fields(&mut fields));
    fields
}

/// Notes the fields that a struct asks for, and then gives up.
struct Fields<'a>(&'a mut &'static [&'static str]);

impl<'de> Deserializer<'de> for Fields<'_> {
    type Error = value::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        _visitor: V,
    ) -> Result<V::Value, value::Error> {
        *self.0 = fields;
        Err(value::Error::custom(
            "only the names of fields are asked for",
        ))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, value::Error> {
        Err(value::Error::custom("not a struct"))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    use super::columns;

    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    struct Row {
        first_field: u32,
        #[serde(rename = "other")]
        second: String,
        #[serde(skip)]
        _hidden: u8,
    }

    #[test]
    fn columns_are_the_fields_that_are_written() {
        assert_eq!(columns::<Row>(), ["first-field", "other"]);
        assert!(columns::<u32>().is_empty());
    }
}
