//! A TOML text with its places: every value knows where it stands, so that what is wrong with it can say where.
use super::read_text;
use crate::Error;
use crate::error::suggestion;
use std::path::Path;
use toml_edit::{ArrayOfTables, Document, Item, TableLike, Value};

/// The text and what the user calls it.
pub(crate) struct Source<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
}

impl Source<'_> {
    pub(crate) fn line(&self, offset: usize) -> usize {
        1 + self.text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
    }
}

/// The document of a text.
///
/// Errors: [`Error::Malformed`] where it is not TOML.
pub(crate) fn parse<'a>(source: &Source<'a>) -> Result<Document<&'a str>, Error> {
    Document::parse(source.text).map_err(|error| {
        let offset = error.span().map_or(source.text.len(), |span| span.start);
        Error::at(source.file, source.text, offset, error.message().to_owned())
    })
}

/// A value of the document and its place.
#[derive(Clone)]
pub(crate) struct Node<'a> {
    source: &'a Source<'a>,
    content: Content<'a>,
    /// Bytes before it.
    pub(crate) offset: usize,
    /// What messages call it: "camera `left`: `fx`".
    label: String,
}

#[derive(Clone, Copy)]
enum Content<'a> {
    Table(&'a dyn TableLike),
    Tables(&'a ArrayOfTables),
    Value(&'a Value),
}

impl<'a> Node<'a> {
    /// The whole document.
    pub(crate) fn root(source: &'a Source<'a>, table: &'a toml_edit::Table) -> Self {
        Node { source, content: Content::Table(table), offset: 0, label: String::new() }
    }

    fn of_item(source: &'a Source<'a>, item: &'a Item, offset: usize, label: String) -> Option<Self> {
        let content = match item {
            Item::None => return None,
            Item::Value(Value::InlineTable(table)) => Content::Table(table),
            Item::Value(value) => Content::Value(value),
            Item::Table(table) => Content::Table(table),
            Item::ArrayOfTables(tables) => Content::Tables(tables),
        };
        // A table that is written as dotted keys, or under several headers, stands where its key does.
        let offset = item.as_value().and_then(Value::span).map_or(offset, |span| span.start);
        Some(Node { source, content, offset, label })
    }

    /// What is wrong with it.
    pub(crate) fn error(&self, problem: impl std::fmt::Display) -> Error {
        let separator = if self.label.is_empty() { "" } else { ": " };
        Error::at(self.source.file, self.source.text, self.offset, format!("{}{separator}{problem}", self.label))
    }

    fn unexpected(&self, expected: &str) -> Error {
        self.error(format!("expected {expected}, found {}", self.description()))
    }

    fn description(&self) -> String {
        match self.content {
            Content::Table(_) => "a table".to_owned(),
            Content::Tables(_) => "tables".to_owned(),
            Content::Value(Value::String(_)) => "a string".to_owned(),
            Content::Value(Value::Integer(number)) => format!("the number {}", number.value()),
            Content::Value(Value::Float(number)) => format!("the number {:?}", number.value()),
            Content::Value(Value::Boolean(flag)) => flag.value().to_string(),
            Content::Value(Value::Datetime(_)) => "a date".to_owned(),
            Content::Value(Value::Array(_)) => "an array".to_owned(),
            Content::Value(Value::InlineTable(_)) => "a table".to_owned(),
        }
    }

    /// The line on which it stands.
    pub(crate) fn line(&self) -> usize {
        self.source.line(self.offset)
    }

    pub(crate) fn number(&self) -> Result<f64, Error> {
        let number = match self.content {
            Content::Value(Value::Float(number)) => *number.value(),
            Content::Value(Value::Integer(number)) => *number.value() as f64,
            _ => return Err(self.unexpected("a number")),
        };
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.error(format!("expected a finite number, found {number}")))
        }
    }

    pub(crate) fn positive(&self) -> Result<f64, Error> {
        let number = self.number()?;
        if number > 0.0 { Ok(number) } else { Err(self.error(format!("must be above 0, found {number}"))) }
    }

    /// A standard deviation that may be 0.
    pub(crate) fn not_negative(&self) -> Result<f64, Error> {
        let number = self.number()?;
        if number >= 0.0 { Ok(number) } else { Err(self.error(format!("must be 0 or more, found {number}"))) }
    }

    pub(crate) fn whole<T: TryFrom<i64>>(&self) -> Result<T, Error> {
        let Content::Value(Value::Integer(number)) = self.content else {
            return Err(self.unexpected("a whole number"));
        };
        T::try_from(*number.value()).map_err(|_| self.error(format!("{} is out of range", number.value())))
    }

    pub(crate) fn flag(&self) -> Result<bool, Error> {
        match self.content {
            Content::Value(Value::Boolean(flag)) => Ok(*flag.value()),
            _ => Err(self.unexpected("true or false")),
        }
    }

    pub(crate) fn text(&self) -> Result<&'a str, Error> {
        match self.content {
            Content::Value(Value::String(text)) => Ok(text.value()),
            _ => Err(self.unexpected("a string")),
        }
    }

    /// Name and text of a file that a string names, relative to this one.
    pub(super) fn text_of_file(&self) -> Result<(String, String), Error> {
        let folder = Path::new(self.source.file).parent().unwrap_or(Path::new(""));
        let path = folder.join(self.text()?);
        // Devices and pipes need not end.
        let text = if path.exists() && !path.is_file() {
            Err(Error::io(&path, std::io::ErrorKind::InvalidInput.into()))
        } else {
            read_text(&path)
        };
        match text {
            Ok(text) => Ok((path.display().to_string(), text)),
            Err(error @ Error::Io { .. }) => Err(self.error(error)),
            Err(error) => Err(error),
        }
    }

    /// A string that is one of the known words.
    pub(crate) fn word<T: Copy>(&self, what: &str, known: &[T], name: impl Fn(T) -> &'static str) -> Result<T, Error> {
        let found = self.text()?;
        known.iter().copied().find(|value| name(*value) == found).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|value| name(*value)).collect();
            self.error(format!("unknown {what} `{found}` (known: {})", names.join(", ")))
        })
    }

    /// The entries of an array, or of an array of tables.
    pub(crate) fn list(&self) -> Result<Vec<Node<'a>>, Error> {
        let entry = |content, span: Option<std::ops::Range<usize>>, index: usize| Node {
            source: self.source,
            content,
            offset: span.map_or(self.offset, |span| span.start),
            label: format!("{} {}", self.label, index + 1).trim_start().to_owned(),
        };
        match self.content {
            Content::Value(Value::Array(array)) => Ok(array
                .iter()
                .enumerate()
                .map(|(i, value)| match value {
                    Value::InlineTable(table) => entry(Content::Table(table), table.span(), i),
                    _ => entry(Content::Value(value), value.span(), i),
                })
                .collect()),
            Content::Tables(tables) => {
                Ok(tables.iter().enumerate().map(|(i, table)| entry(Content::Table(table), table.span(), i)).collect())
            }
            _ => Err(self.unexpected("an array")),
        }
    }

    /// An array of exactly N numbers.
    pub(crate) fn numbers<const N: usize>(&self) -> Result<[f64; N], Error> {
        let numbers = self.any_numbers()?;
        <[f64; N]>::try_from(numbers)
            .map_err(|found| self.error(format!("expected {N} numbers, found {}", found.len())))
    }

    /// An array of any length.
    pub(crate) fn any_numbers(&self) -> Result<Vec<f64>, Error> {
        self.list()?.iter().map(Node::number).collect()
    }

    /// A table, where all of its keys are known.
    pub(crate) fn table(self, known: &[&str]) -> Result<Fields<'a>, Error> {
        let fields = self.any_table()?;
        for field in fields.iter() {
            if !known.contains(&field.key) {
                let known = suggestion(field.key, known.iter().copied());
                return Err(Node { offset: field.key_offset, ..fields.node.clone() }
                    .error(format!("unknown key `{}` {known}", field.key)));
            }
        }
        Ok(fields)
    }

    /// A table of any keys.
    pub(crate) fn any_table(self) -> Result<Fields<'a>, Error> {
        match self.content {
            Content::Table(table) => Ok(Fields { node: self, table }),
            _ => Err(self.unexpected("a table")),
        }
    }

    pub(crate) fn is_table(&self) -> bool {
        matches!(self.content, Content::Table(_))
    }

    pub(crate) fn is_list(&self) -> bool {
        matches!(self.content, Content::Value(Value::Array(_)) | Content::Tables(_))
    }
}

/// A table and its place.
pub(crate) struct Fields<'a> {
    pub(crate) node: Node<'a>,
    table: &'a dyn TableLike,
}

/// A key of a table, its place and its value.
pub(crate) struct Field<'a> {
    pub(crate) key: &'a str,
    pub(crate) key_offset: usize,
    pub(crate) value: Node<'a>,
}

impl<'a> Fields<'a> {
    /// Calls the table by another name in messages.
    pub(crate) fn labelled(mut self, label: impl Into<String>) -> Self {
        self.node.label = label.into();
        self
    }

    pub(crate) fn error(&self, problem: impl std::fmt::Display) -> Error {
        self.node.error(problem)
    }

    /// The value of a key.
    pub(crate) fn field(&self, key: &str) -> Option<Field<'a>> {
        let (key, item) = self.table.get_key_value(key)?;
        let key_offset = key.span().map_or(self.node.offset, |span| span.start);
        let label = format!("{}: `{}`", self.node.label, key.get()).trim_start_matches(": ").to_owned();
        let value = Node::of_item(self.node.source, item, key_offset, label)?;
        Some(Field { key: key.get(), key_offset, value })
    }

    /// Every key, in the file's order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Field<'a>> {
        self.table.iter().filter_map(|(key, _)| self.field(key))
    }

    /// What `read` makes of a key's value; `None` where it is left out.
    pub(crate) fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Node<'a>) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        self.field(key).map(|field| read(&field.value)).transpose()
    }

    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>, Error> {
        self.optional(key, Node::number)
    }
}
