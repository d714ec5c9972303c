//! A place or a stretch on a member's axis, as files write it.

use std::{borrow::Cow, fmt};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, SeqAccess, Visitor},
};

/// From and to, as shares of the axis: written as one number where they are equal, else as a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along(pub [f32; 2]);

impl Serialize for Along {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [from, to] = self.0;
        if from.to_bits() == to.to_bits() {
            from.serialize(serializer)
        } else {
            self.0.serialize(serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Along {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Shares)
    }
}

struct Shares;

impl<'de> Visitor<'de> for Shares {
    type Value = Along;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a place on the axis such as 0.4, or a stretch of it such as (0.3, 0.5)")
    }

    fn visit_f64<E: de::Error>(self, at: f64) -> Result<Along, E> {
        Ok(Along([at as f32; 2]))
    }

    fn visit_f32<E: de::Error>(self, at: f32) -> Result<Along, E> {
        Ok(Along([at; 2]))
    }

    fn visit_u64<E: de::Error>(self, at: u64) -> Result<Along, E> {
        Ok(Along([at as f32; 2]))
    }

    fn visit_i64<E: de::Error>(self, at: i64) -> Result<Along, E> {
        Ok(Along([at as f32; 2]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut pair: A) -> Result<Along, A::Error> {
        let mut next = |k| pair.next_element()?.ok_or_else(|| de::Error::invalid_length(k, &self));
        let ends = [next(0)?, next(1)?];
        match pair.next_element::<f32>()? {
            None => Ok(Along(ends)),
            Some(_) => Err(de::Error::invalid_length(3, &self)),
        }
    }
}

impl JsonSchema for Along {
    fn schema_name() -> Cow<'static, str> {
        "Along".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [
            { "type": "number" },
            { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 },
        ] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_one_number_and_a_stretch_two() {
        let read = |text: &str| ron::from_str::<Along>(text).map(|a| a.0);
        for (text, ends) in [
            ("0.4", [0.4, 0.4]),
            ("0", [0.0, 0.0]),
            ("1", [1.0, 1.0]),
            ("-1", [-1.0, -1.0]),
            ("(0.3, 0.5)", [0.3, 0.5]),
            ("(0, 1)", [0.0, 1.0]),
            ("[0.3, 0.5]", [0.3, 0.5]),
        ] {
            assert_eq!(read(text), Ok(ends), "{text}");
        }
        for text in ["\"0.4\"", "(0.3)", "(0.1, 0.2, 0.3)", "()", "true", "(a, b)"] {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(serde_json::to_string(&Along([0.25, 0.25])).unwrap(), "0.25");
        assert_eq!(serde_json::to_string(&Along([0.25, 0.5])).unwrap(), "[0.25,0.5]");
    }
}
