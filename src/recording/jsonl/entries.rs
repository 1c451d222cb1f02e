//! What JSON values must be. Problems are raised while a value is read, so that its place is known.
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A number, and what is made of it.
pub(super) struct Number<F>(pub(super) F);

/// An array of exactly N numbers, and what is made of it.
pub(super) struct Numbers<const N: usize, F>(pub(super) F);

/// An array of any number of numbers.
pub(super) struct List<F>(pub(super) F);

/// An array of strings.
pub(super) struct Texts<F>(pub(super) F);

/// A string.
pub(super) struct Text<F>(pub(super) F);

/// An object of which every entry is handed to its reader.
pub(super) struct Object<'a, E>(pub(super) &'a mut E);

/// Reads the entries of an object into itself.
pub(super) trait Entries {
    /// What a key stands for.
    type Key;
    /// What the object is: "a table of cameras".
    const WHAT: &'static str;

    /// The meaning of a key, or what is wrong with it.
    fn key(&mut self, name: &str) -> Result<Self::Key, String>;

    /// Reads the value of a key.
    fn value<'de, A: MapAccess<'de>>(&mut self, key: Self::Key, map: &mut A) -> Result<(), A::Error>;

    /// What is wrong with the object as a whole.
    fn finish(&mut self) -> Result<(), String> {
        Ok(())
    }
}

impl<'de, T, F: FnOnce(f64) -> Result<T, String>> DeserializeSeed<'de> for Number<F> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_f64(self)
    }
}

impl<'de, T, F: FnOnce(f64) -> Result<T, String>> Visitor<'de> for Number<F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<T, E> {
        if !number.is_finite() {
            return Err(E::custom("expected a finite number"));
        }
        (self.0)(number).map_err(E::custom)
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }
}

impl<'de, const N: usize, T, F: FnOnce([f64; N]) -> Result<T, String>> DeserializeSeed<'de> for Numbers<N, F> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, const N: usize, T, F: FnOnce([f64; N]) -> Result<T, String>> Visitor<'de> for Numbers<N, F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "an array of {N} numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<T, A::Error> {
        let (mut numbers, mut found) = ([0.0; N], 0);
        while let Some(number) = seq.next_element_seed(Number(Ok))? {
            if let Some(place) = numbers.get_mut(found) {
                *place = number;
            }
            found += 1;
        }
        if found != N {
            return Err(A::Error::custom(format!("expected {N} numbers, found {found}")));
        }
        (self.0)(numbers).map_err(A::Error::custom)
    }
}

impl<'de, T, F: FnOnce(Vec<f64>) -> Result<T, String>> DeserializeSeed<'de> for List<F> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, T, F: FnOnce(Vec<f64>) -> Result<T, String>> Visitor<'de> for List<F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<T, A::Error> {
        let mut numbers = Vec::new();
        while let Some(number) = seq.next_element_seed(Number(Ok))? {
            numbers.push(number);
        }
        (self.0)(numbers).map_err(A::Error::custom)
    }
}

impl<'de, T, F: FnMut(&str) -> Result<T, String>> DeserializeSeed<'de> for Texts<F> {
    type Value = Vec<T>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Vec<T>, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, T, F: FnMut(&str) -> Result<T, String>> Visitor<'de> for Texts<F> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array of strings")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut seq: A) -> Result<Vec<T>, A::Error> {
        let mut texts = Vec::new();
        while let Some(text) = seq.next_element_seed(Text(&mut self.0))? {
            texts.push(text);
        }
        Ok(texts)
    }
}

impl<'de, T, F: FnOnce(&str) -> Result<T, String>> DeserializeSeed<'de> for Text<F> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<'de, T, F: FnOnce(&str) -> Result<T, String>> Visitor<'de> for Text<F> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a string")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        (self.0)(text).map_err(E::custom)
    }
}

impl<'de, R: Entries> DeserializeSeed<'de> for Object<'_, R> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, R: Entries> Visitor<'de> for Object<'_, R> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(R::WHAT)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key_seed(Text(|name: &str| self.0.key(name)))? {
            self.0.value(key, &mut map)?;
        }
        self.0.finish().map_err(A::Error::custom)
    }
}

/// The keys of an object that were met, of those that it may have.
pub(super) struct Keys {
    known: &'static [&'static str],
    met: Vec<bool>,
}

impl Keys {
    pub(super) fn new(known: &'static [&'static str]) -> Self {
        Keys { known, met: vec![false; known.len()] }
    }

    /// The known key of that name, unless it was met before.
    pub(super) fn meet(&mut self, name: &str) -> Result<&'static str, String> {
        let known = self.known.iter().copied();
        let Some(index) = known.clone().position(|key| key == name) else {
            return Err(format!("unknown key `{name}` {}", crate::error::suggestion(name, known)));
        };
        if std::mem::replace(&mut self.met[index], true) {
            return Err(format!("`{name}` is given twice"));
        }
        Ok(self.known[index])
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.known.iter().zip(&self.met).any(|(key, met)| *met && *key == name)
    }
}
