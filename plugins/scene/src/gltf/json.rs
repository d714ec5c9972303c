//! Lenient access to JSON: what is absent or of the wrong type reads as absent (the schema check
//! has reported it).

use serde_json::Value;

/// Reading fields that may not be there.
pub(super) trait Json {
    /// The value, `null` where absent.
    fn field(&self, key: &str) -> &Value;
    /// A non-negative integer; `1.0` counts as one.
    fn index(&self, key: &str) -> Option<usize>;
    /// A finite number.
    fn number(&self, key: &str) -> Option<f64>;
    /// The elements, none where absent.
    fn list(&self, key: &str) -> &[Value];
    /// A text.
    fn text(&self, key: &str) -> Option<&str>;
    /// Exactly `N` finite numbers.
    fn numbers<const N: usize>(&self, key: &str) -> Option<[f64; N]>;
    /// The object of an extension.
    fn extension(&self, name: &str) -> Option<&Value>;
}

static NULL: Value = Value::Null;

impl Json for Value {
    fn field(&self, key: &str) -> &Value {
        self.get(key).unwrap_or(&NULL)
    }
    fn index(&self, key: &str) -> Option<usize> {
        as_index(self.field(key))
    }
    fn number(&self, key: &str) -> Option<f64> {
        self.field(key).as_f64().filter(|x| x.is_finite())
    }
    fn list(&self, key: &str) -> &[Value] {
        self.field(key).as_array().map_or(&[], Vec::as_slice)
    }
    fn text(&self, key: &str) -> Option<&str> {
        self.field(key).as_str()
    }
    fn numbers<const N: usize>(&self, key: &str) -> Option<[f64; N]> {
        let list = self.list(key);
        let mut numbers = [0.0; N];
        if list.len() != N {
            return None;
        }
        for (number, value) in numbers.iter_mut().zip(list) {
            *number = value.as_f64().filter(|x| x.is_finite())?;
        }
        Some(numbers)
    }
    fn extension(&self, name: &str) -> Option<&Value> {
        self.field("extensions").get(name).filter(|e| e.is_object())
    }
}

/// An index: a non-negative integer, also written as `1.0`.
pub(super) fn as_index(value: &Value) -> Option<usize> {
    let index = value.as_u64().or_else(|| {
        let x = value.as_f64()?;
        ((0.0..9e15).contains(&x) && x.fract() == 0.0).then_some(x as u64)
    })?;
    usize::try_from(index).ok()
}

/// A key as a segment of a JSON pointer.
pub(super) fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}
