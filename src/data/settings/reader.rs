//! Settings out of a table, with one deserialiser for all of them: a struct is compiled anew for every kind of deserialiser that it meets.
//! This one asks each value for its own kind alone, where `toml`'s offers every kind to every struct, and its failures keep the keys that
//! lead to them.

use std::fmt::{self, Display};

use serde::de::value::BorrowedStrDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error as _, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, VariantAccess, Visitor,
};
use toml::{Table, Value};

/// What was wrong with a value, and the keys that lead to it: the outermost first, an item of a list by its index.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    pub keys: Vec<String>,
    pub message: String,
}

impl Failure {
    fn below(mut self, key: &str) -> Self {
        self.keys.insert(0, key.into());
        self
    }
}

impl Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match &self.keys[..] {
            [] => formatter.write_str(&self.message),
            keys => write!(formatter, "`{}`: {}", keys.join("."), self.message),
        }
    }
}

impl std::error::Error for Failure {}

impl serde::de::Error for Failure {
    fn custom<T: Display>(message: T) -> Self {
        Self { keys: vec![], message: message.to_string() }
    }
}

/// Reads settings out of a table.
pub fn read_table<T: DeserializeOwned>(table: Table) -> Result<T, Failure> {
    T::deserialize(Reader(&Value::Table(table)))
}

struct Reader<'a>(&'a Value);

fn wrong(found: &Value, expected: &dyn Expected) -> Failure {
    Failure::invalid_type(
        match found {
            Value::String(text) => Unexpected::Str(text),
            Value::Integer(number) => Unexpected::Signed(*number),
            Value::Float(number) => Unexpected::Float(*number),
            Value::Boolean(truth) => Unexpected::Bool(*truth),
            Value::Datetime(_) => Unexpected::Other("date or time"),
            Value::Array(_) => Unexpected::Seq,
            Value::Table(_) => Unexpected::Map,
        },
        expected,
    )
}

/// Methods that take one kind of value each.
macro_rules! takes {
    ($($method:ident $($pattern:pat => $visit:ident($($value:expr)?)),+;)*) => { $(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
            match self.0 {
                $($pattern => visitor.$visit($($value)?),)+
                other => Err(wrong(other, &visitor)),
            }
        }
    )* };
}

impl<'de> Deserializer<'de> for Reader<'de> {
    type Error = Failure;

    takes! {
        deserialize_bool Value::Boolean(truth) => visit_bool(*truth);
        deserialize_i8 Value::Integer(number) => visit_i64(*number);
        deserialize_i16 Value::Integer(number) => visit_i64(*number);
        deserialize_i32 Value::Integer(number) => visit_i64(*number);
        deserialize_i64 Value::Integer(number) => visit_i64(*number);
        deserialize_u8 Value::Integer(number) => visit_i64(*number);
        deserialize_u16 Value::Integer(number) => visit_i64(*number);
        deserialize_u32 Value::Integer(number) => visit_i64(*number);
        deserialize_u64 Value::Integer(number) => visit_i64(*number);
        deserialize_f32 Value::Float(number) => visit_f64(*number), Value::Integer(number) => visit_i64(*number);
        deserialize_f64 Value::Float(number) => visit_f64(*number), Value::Integer(number) => visit_i64(*number);
        deserialize_char Value::String(text) => visit_borrowed_str(text);
        deserialize_str Value::String(text) => visit_borrowed_str(text);
        deserialize_string Value::String(text) => visit_borrowed_str(text);
        deserialize_identifier Value::String(text) => visit_borrowed_str(text);
        deserialize_map Value::Table(table) => visit_map(Entries { rest: table.iter(), next: None });
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        match self.0 {
            Value::String(text) => visitor.visit_borrowed_str(text),
            Value::Integer(number) => visitor.visit_i64(*number),
            Value::Float(number) => visitor.visit_f64(*number),
            Value::Boolean(truth) => visitor.visit_bool(*truth),
            Value::Array(_) => self.deserialize_seq(visitor),
            Value::Table(_) => self.deserialize_map(visitor),
            // No setting is a date; free texts are shown as they were written.
            Value::Datetime(date) => visitor.visit_string(date.to_string()),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let Value::Array(all) = self.0 else { return Err(wrong(self.0, &visitor)) };
        let mut items = Items { rest: all, index: 0 };
        let value = visitor.visit_seq(&mut items)?;
        if items.rest.is_empty() { Ok(value) } else { Err(Failure::invalid_length(all.len(), &"fewer items")) }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _name: &'static str, visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, Failure> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _length: usize,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.deserialize_map(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        match self.0 {
            Value::String(text) => visitor.visit_enum(text.as_str().into_deserializer()),
            Value::Table(table) if table.len() == 1 => {
                let (name, value) = table.iter().next().expect("one entry");
                visitor.visit_enum(Variant { name, value })
            }
            other => Err(wrong(other, &visitor)),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! { bytes byte_buf unit unit_struct }
}

struct Items<'a> {
    rest: &'a [Value],
    index: usize,
}

impl<'a> SeqAccess<'a> for Items<'a> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'a>>(&mut self, seed: T) -> Result<Option<T::Value>, Failure> {
        let Some((first, rest)) = self.rest.split_first() else { return Ok(None) };
        self.rest = rest;
        self.index += 1;
        seed.deserialize(Reader(first)).map(Some).map_err(|failure| failure.below(&(self.index - 1).to_string()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

struct Entries<'a> {
    rest: toml::map::Iter<'a, String, Value>,
    next: Option<(&'a String, &'a Value)>,
}

impl<'a> MapAccess<'a> for Entries<'a> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Failure> {
        self.next = self.rest.next();
        let Some((key, _)) = self.next else { return Ok(None) };
        seed.deserialize(BorrowedStrDeserializer::new(key)).map(Some).map_err(|failure: Failure| failure.below(key))
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Failure> {
        let (key, value) = self.next.take().expect("a key was asked for first");
        seed.deserialize(Reader(value)).map_err(|failure| failure.below(key))
    }
}

/// A variant with contents: a table of one key.
struct Variant<'a> {
    name: &'a str,
    value: &'a Value,
}

impl<'a> EnumAccess<'a> for Variant<'a> {
    type Error = Failure;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'a>>(self, seed: V) -> Result<(V::Value, Self), Failure> {
        let variant =
            seed.deserialize(BorrowedStrDeserializer::new(self.name)).map_err(|failure: Failure| failure.below(self.name))?;
        Ok((variant, self))
    }
}

impl<'a> VariantAccess<'a> for Variant<'a> {
    type Error = Failure;

    fn unit_variant(self) -> Result<(), Failure> {
        match self.value {
            Value::Table(table) if table.is_empty() => Ok(()),
            other => Err(wrong(other, &"no contents").below(self.name)),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'a>>(self, seed: T) -> Result<T::Value, Failure> {
        seed.deserialize(Reader(self.value)).map_err(|failure| failure.below(self.name))
    }

    fn tuple_variant<V: Visitor<'a>>(self, _length: usize, visitor: V) -> Result<V::Value, Failure> {
        Reader(self.value).deserialize_seq(visitor).map_err(|failure| failure.below(self.name))
    }

    fn struct_variant<V: Visitor<'a>>(self, _fields: &'static [&'static str], visitor: V) -> Result<V::Value, Failure> {
        Reader(self.value).deserialize_map(visitor).map_err(|failure| failure.below(self.name))
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(rename_all = "snake_case", deny_unknown_fields)]
    enum Shape {
        Point,
        Ball { radius_m: f64 },
        Box(f32, f32, f32),
        Many(Vec<Shape>),
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Scene {
        name: String,
        seed: u64,
        #[serde(default)]
        near: Option<bool>,
        shapes: Vec<Shape>,
    }

    fn read(text: &str) -> Result<Scene, Failure> {
        read_table(text.parse().unwrap())
    }

    #[test]
    fn every_kind_of_value_is_read() {
        let text = r#"
            name = "a"
            seed = 3
            near = true
            shapes = ["point", { point = {} }, { ball = { radius_m = 2 } }, { box = [1, 2.5, 3] }, { many = ["point"] }]
        "#;
        let shapes = vec![
            Shape::Point,
            Shape::Point,
            Shape::Ball { radius_m: 2.0 },
            Shape::Box(1.0, 2.5, 3.0),
            Shape::Many(vec![Shape::Point]),
        ];
        assert_eq!(read(text).unwrap(), Scene { name: "a".into(), seed: 3, near: Some(true), shapes });
    }

    #[test]
    fn a_failure_keeps_the_keys_that_lead_to_it() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        assert_eq!(message("name = 1"), "`name`: invalid type: integer `1`, expected a string");
        assert_eq!(message("name = \"a\"\nseed = -1"), "`seed`: invalid value: integer `-1`, expected u64");
        assert_eq!(message("name = \"a\""), "missing field `seed`");
        assert_eq!(
            message("name = \"a\"\nsed = 1"),
            "`sed`: unknown field `sed`, expected one of `name`, `seed`, `near`, `shapes`"
        );
        let of = |shapes: &str| message(&format!("name = \"a\"\nseed = 1\nshapes = {shapes}"));
        assert_eq!(
            of("[\"point\", { ball = { radius_m = \"x\" } }]"),
            "`shapes.1.ball.radius_m`: invalid type: string \"x\", expected f64"
        );
        assert_eq!(of("[\"ring\"]"), "`shapes.0`: unknown variant `ring`, expected one of `point`, `ball`, `box`, `many`");
        assert_eq!(
            of("[{ box = [1.0] }]"),
            "`shapes.0.box`: invalid length 1, expected tuple variant Shape::Box with 3 elements"
        );
        assert_eq!(of("[{ box = [1, 2, 3, 4] }]"), "`shapes.0.box`: invalid length 4, expected fewer items");
        assert_eq!(of("[{ point = 1 }]"), "`shapes.0.point`: invalid type: integer `1`, expected no contents");
        assert_eq!(of("{ }"), "`shapes`: invalid type: map, expected a sequence");
    }
}
