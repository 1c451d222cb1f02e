//! The wanted fields of a message, decoded from CDR by its layout.
use super::schema::{Field, Layout};
use re_cdr::{BigEndian, ByteOrder, CdrEndian, CdrReader, LittleEndian};
use re_ros_msg::message_spec::BuiltInType;

/// A value in a message; numbers of all kinds are floats, and the longest integers that are needed have 32 bits.
#[derive(Debug)]
pub(super) enum Value<'a> {
    Number(f64),
    Text(&'a str),
    Texts(Texts<'a>),
    Numbers(Vec<f64>),
    Bytes(&'a [u8]),
    List(Vec<Value<'a>>),
    Message(Vec<(&'a str, Value<'a>)>),
}

/// Texts as they stand in a message: who reads the same ones again and again need not take them apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texts<'a> {
    pub bytes: &'a [u8],
    count: usize,
    is_big: bool,
}

impl Texts<'_> {
    /// Errors: what is wrong with the bytes, in words.
    pub(super) fn to_vec(self) -> Result<Vec<String>, String> {
        fn list<BO: CdrEndian>(bytes: &[u8], count: usize) -> re_cdr::Result<Vec<String>> {
            let mut reader = CdrReader::<BO>::new(bytes);
            (0..count).map(|_| text(&mut reader).map(str::to_owned)).collect()
        }
        let of = if self.is_big { list::<BigEndian> } else { list::<LittleEndian> };
        of(self.bytes, self.count).map_err(|error| format!("does not fit its schema: {error}"))
    }
}

impl<'a> Value<'a> {
    /// Decodes a message, its encapsulation header included.
    ///
    /// Errors: what is wrong with the bytes, in words.
    pub(super) fn decode(layout: &'a Layout, bytes: &'a [u8]) -> Result<Value<'a>, String> {
        let Some((header, body)) = bytes.split_at_checked(4) else {
            return Err(format!("has {} bytes, less than the header of CDR", bytes.len()));
        };
        let value = match [header[0], header[1]] {
            [0, 0] => value(layout, body, true, &mut CdrReader::<BigEndian>::new(body)),
            [0, 1] => value(layout, body, false, &mut CdrReader::<LittleEndian>::new(body)),
            [a, b] => return Err(format!("is encoded as {a:02x} {b:02x}, and 00 00 and 00 01 (plain CDR) are known")),
        };
        value.map_err(|error| format!("does not fit its schema: {error}"))
    }

    /// What stands at a path of field names, `header.stamp.sec`.
    pub(super) fn at(&self, path: &str) -> Option<&Value<'a>> {
        path.split('.').try_fold(self, |value, name| match value {
            Value::Message(fields) => fields.iter().find(|(known, _)| *known == name).map(|(_, value)| value),
            _ => None,
        })
    }

    pub(super) fn number(&self, path: &str) -> Option<f64> {
        if let Some(Value::Number(number)) = self.at(path) { Some(*number) } else { None }
    }

    pub(super) fn text(&self, path: &str) -> Option<&'a str> {
        if let Some(Value::Text(text)) = self.at(path) { Some(text) } else { None }
    }

    pub(super) fn numbers(&self, path: &str) -> Option<&[f64]> {
        if let Some(Value::Numbers(numbers)) = self.at(path) { Some(numbers) } else { None }
    }

    pub(super) fn bytes(&self, path: &str) -> Option<&'a [u8]> {
        if let Some(Value::Bytes(bytes)) = self.at(path) { Some(bytes) } else { None }
    }

    pub(super) fn texts(&self, path: &str) -> Option<Texts<'a>> {
        if let Some(Value::Texts(texts)) = self.at(path) { Some(*texts) } else { None }
    }

    pub(super) fn list(&self, path: &str) -> Option<&[Value<'a>]> {
        if let Some(Value::List(list)) = self.at(path) { Some(list) } else { None }
    }
}

/// `body`: all that is read from, in which texts are found again.
fn value<'a, BO: CdrEndian>(
    layout: &'a Layout,
    body: &'a [u8],
    is_big: bool,
    reader: &mut CdrReader<'a, BO>,
) -> re_cdr::Result<Value<'a>> {
    match layout {
        Layout::Builtin(BuiltInType::String(_)) => Ok(Value::Text(text(reader)?)),
        Layout::Builtin(kind) => Ok(Value::Number(number(kind, reader)?)),
        Layout::Array { element, length } => {
            let count = count(*length, reader)?;
            match element.as_ref() {
                Layout::Builtin(BuiltInType::UInt8 | BuiltInType::Byte) => Ok(Value::Bytes(reader.read_bytes(count)?)),
                Layout::Builtin(BuiltInType::String(_)) => {
                    let start = reader.position();
                    (0..count).try_for_each(|_| bytes(reader).map(|_| ()))?;
                    Ok(Value::Texts(Texts { bytes: &body[start..reader.position()], count, is_big }))
                }
                Layout::Builtin(BuiltInType::Float64) => Ok(Value::Numbers(reader.read_numeric_vec::<f64>(count)?)),
                Layout::Builtin(kind) if !matches!(kind, BuiltInType::String(_) | BuiltInType::WString(_)) => {
                    Ok(Value::Numbers((0..count).map(|_| number(kind, reader)).collect::<re_cdr::Result<_>>()?))
                }
                element => {
                    let values = (0..count).map(|_| value(element, body, is_big, reader));
                    Ok(Value::List(values.collect::<re_cdr::Result<_>>()?))
                }
            }
        }
        Layout::Message(fields) => {
            let mut values = Vec::with_capacity(fields.iter().filter(|field| field.is_wanted).count());
            for Field { name, layout, is_wanted } in fields {
                if *is_wanted {
                    values.push((name.as_str(), value(layout, body, is_big, reader)?));
                } else {
                    skip(layout, reader)?;
                }
            }
            Ok(Value::Message(values))
        }
    }
}

fn skip<BO: ByteOrder>(layout: &Layout, reader: &mut CdrReader<'_, BO>) -> re_cdr::Result<()> {
    match layout {
        Layout::Builtin(BuiltInType::String(_)) => bytes(reader).map(|_| ()),
        Layout::Builtin(kind) => skip_numbers(width(kind)?, 1, reader),
        Layout::Array { element, length } => {
            let count = count(*length, reader)?;
            match element.as_ref() {
                Layout::Builtin(kind) if !matches!(kind, BuiltInType::String(_)) => {
                    skip_numbers(width(kind)?, count, reader)
                }
                element => (0..count).try_for_each(|_| skip(element, reader)),
            }
        }
        Layout::Message(fields) => fields.iter().try_for_each(|field| skip(&field.layout, reader)),
    }
}

fn skip_numbers<BO: ByteOrder>(width: usize, count: usize, reader: &mut CdrReader<'_, BO>) -> re_cdr::Result<()> {
    if count == 0 {
        return Ok(());
    }
    reader.align(width)?;
    reader.read_bytes(width.saturating_mul(count)).map(|_| ())
}

/// How many elements follow. Each takes a byte at least, so that more than there are bytes is a mistake.
fn count<BO: ByteOrder>(length: Option<usize>, reader: &mut CdrReader<'_, BO>) -> re_cdr::Result<usize> {
    let count = match length {
        Some(length) => length,
        None => reader.read_u32()? as usize,
    };
    if count > reader.remaining() { Err(re_cdr::Error::UnexpectedEof) } else { Ok(count) }
}

fn bytes<'a, BO: ByteOrder>(reader: &mut CdrReader<'a, BO>) -> re_cdr::Result<&'a [u8]> {
    let length = reader.read_u32()?;
    reader.read_bytes(length as usize)
}

/// A text ends with a zero, which some writers leave out where it is empty.
fn text<'a, BO: ByteOrder>(reader: &mut CdrReader<'a, BO>) -> re_cdr::Result<&'a str> {
    let bytes = bytes(reader)?;
    Ok(std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes))?)
}

fn number<BO: ByteOrder>(kind: &BuiltInType, reader: &mut CdrReader<'_, BO>) -> re_cdr::Result<f64> {
    Ok(match kind {
        BuiltInType::Bool | BuiltInType::Byte | BuiltInType::Char | BuiltInType::UInt8 => f64::from(reader.read_u8()?),
        BuiltInType::Int8 => f64::from(reader.read_i8()?),
        BuiltInType::Int16 => f64::from(reader.read_i16()?),
        BuiltInType::UInt16 => f64::from(reader.read_u16()?),
        BuiltInType::Int32 => f64::from(reader.read_i32()?),
        BuiltInType::UInt32 => f64::from(reader.read_u32()?),
        BuiltInType::Int64 => reader.read_i64()? as f64,
        BuiltInType::UInt64 => reader.read_u64()? as f64,
        BuiltInType::Float32 => f64::from(reader.read_f32()?),
        BuiltInType::Float64 => reader.read_f64()?,
        BuiltInType::String(_) | BuiltInType::WString(_) => return Err(wide()),
    })
}

/// Bytes that a number takes.
fn width(kind: &BuiltInType) -> re_cdr::Result<usize> {
    Ok(match kind {
        BuiltInType::Bool | BuiltInType::Byte | BuiltInType::Char | BuiltInType::UInt8 | BuiltInType::Int8 => 1,
        BuiltInType::Int16 | BuiltInType::UInt16 => 2,
        BuiltInType::Int32 | BuiltInType::UInt32 | BuiltInType::Float32 => 4,
        BuiltInType::Int64 | BuiltInType::UInt64 | BuiltInType::Float64 => 8,
        BuiltInType::String(_) | BuiltInType::WString(_) => return Err(wide()),
    })
}

/// DDS vendors disagree on how many bytes a character of them takes.
fn wide() -> re_cdr::Error {
    re_cdr::Error::Custom("wide strings are not read".to_owned())
}
