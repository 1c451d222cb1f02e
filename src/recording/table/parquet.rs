//! Tables in Parquet files, with LeRobot's lists of numbers as a column each.
use super::Rows;
use super::lerobot::Info;
use crate::Error;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};
use parquet::schema::types::{Type, TypePtr};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A Parquet file that is read row by row.
pub(super) struct Parquet {
    path: PathBuf,
    header: Vec<String>,
    /// For each column the field that it is of, and which number of it where that is a list.
    places: Vec<(usize, Option<usize>)>,
    fields: Vec<TypePtr>,
    /// Rows of the fields that are wanted, whose indices stand beside; `None` before the first.
    rows: Option<(RowIter<'static>, Vec<usize>)>,
    /// Number of the row that was read last, from 1; 0 before any.
    row: usize,
}

/// LeRobot's lists, and what their numbers are called here.
const LISTS: [(&str, &str); 2] = [("observation.state", "joints"), ("action", "action")];

impl Parquet {
    pub(super) fn open(path: &Path, info: &Info) -> Result<Parquet, Error> {
        let reader = reader(path)?;
        let fields = reader.metadata().file_metadata().schema_descr().root_schema().get_fields().to_vec();
        let mut parquet =
            Parquet { path: path.to_owned(), header: Vec::new(), places: Vec::new(), fields, rows: None, row: 0 };
        for (index, field) in parquet.fields.iter().enumerate() {
            let known = LISTS.iter().find(|(name, _)| *name == field.name() && !field.is_primitive());
            let Some((name, prefix)) = known else {
                parquet.header.push(field.name().to_owned());
                parquet.places.push((index, None));
                continue;
            };
            let named = if *prefix == "joints" { &info.state } else { &info.action };
            let length = first_length(path, field)?.unwrap_or(named.len());
            if length != named.len() && !named.is_empty() {
                return Err(Error::Unusable(format!(
                    "{}: `{name}` has {length} numbers, and meta/info.json names {}: {}",
                    path.display(),
                    named.len(),
                    named.join(", ")
                )));
            }
            for number in 0..length {
                let joint = named.get(number).cloned().unwrap_or_else(|| format!("j{}", number + 1));
                parquet.header.push(format!("{prefix}.{joint}"));
                parquet.places.push((index, Some(number)));
            }
        }
        Ok(parquet)
    }

    fn cannot(&self, error: &ParquetError) -> Error {
        cannot(&self.path, error)
    }

    /// Begins to read the fields that are wanted.
    fn begin(&self, wanted: &[bool]) -> Result<(RowIter<'static>, Vec<usize>), Error> {
        let columns = self.places.iter().zip(wanted).filter(|(_, wanted)| **wanted);
        let mut fields: Vec<usize> = columns.map(|((field, _), _)| *field).collect();
        fields.dedup();
        // A projection of nothing is everything.
        let of = if fields.is_empty() { (0..self.fields.len().min(1)).collect() } else { fields };
        let rows = rows(&self.path, of.iter().map(|field| self.fields[*field].clone()).collect())?;
        Ok((rows, of))
    }

    /// The number in a column, NaN where there is none.
    fn number(&self, column: usize, field: &Field) -> Result<f64, Error> {
        let field = match (field, self.places[column].1) {
            (Field::ListInternal(list), Some(number)) => {
                let length = self.places.iter().filter(|place| place.0 == self.places[column].0).count();
                let found = list.elements().len();
                if found != length {
                    return Err(
                        self.error(column, format!("this list has {found} numbers, and those before have {length}"))
                    );
                }
                &list.elements()[number]
            }
            (field, _) => field,
        };
        let value = match *field {
            Field::Null => f64::NAN,
            Field::Bool(value) => f64::from(u8::from(value)),
            Field::Byte(value) => f64::from(value),
            Field::Short(value) => f64::from(value),
            Field::Int(value) => f64::from(value),
            Field::Long(value) => value as f64,
            Field::UByte(value) => f64::from(value),
            Field::UShort(value) => f64::from(value),
            Field::UInt(value) => f64::from(value),
            Field::ULong(value) => value as f64,
            Field::Float(value) => shortest(value),
            Field::Double(value) => value,
            Field::TimestampMillis(value) => value as f64 / 1e3,
            Field::TimestampMicros(value) => value as f64 / 1e6,
            _ => return Err(self.error(column, format!("{field} is no number"))),
        };
        if value.is_infinite() { Err(self.error(column, format!("{value} is no number"))) } else { Ok(value) }
    }
}

impl Rows for Parquet {
    fn header(&self) -> &[String] {
        &self.header
    }

    fn next(&mut self, wanted: &[bool], row: &mut Vec<f64>) -> Result<bool, Error> {
        let (mut rows, fields) = match self.rows.take() {
            Some(rows) => rows,
            None => self.begin(wanted)?,
        };
        row.clear();
        row.resize(self.header.len(), f64::NAN);
        let next: Option<Row> = rows.next().transpose().map_err(|error| self.cannot(&error))?;
        let Some(found) = next else { return Ok(false) };
        self.row += 1;
        for ((_, value), field) in found.get_column_iter().zip(&fields) {
            for column in (0..self.places.len()).filter(|column| self.places[*column].0 == *field && wanted[*column]) {
                row[column] = self.number(column, value)?;
            }
        }
        self.rows = Some((rows, fields));
        Ok(true)
    }

    fn error(&self, column: usize, problem: String) -> Error {
        let (file, name) = (self.path.display(), self.header.get(column).map_or("", String::as_str));
        match self.row {
            0 => Error::Unusable(format!("{file}: column `{name}`: {problem}")),
            row => Error::Unusable(format!("{file}: row {row}, column `{name}`: {problem}")),
        }
    }

    fn file(&self) -> String {
        self.path.display().to_string()
    }
}

/// The number that a float of 32 bits was written for: 0.1, not 0.10000000149011612.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

fn reader(path: &Path) -> Result<SerializedFileReader<File>, Error> {
    let file = File::open(path).map_err(|source| Error::io(path, source))?;
    SerializedFileReader::new(file).map_err(|error| cannot(path, &error))
}

/// Rows of some of the fields, in the file's order.
fn rows(path: &Path, fields: Vec<TypePtr>) -> Result<RowIter<'static>, Error> {
    let reader = reader(path)?;
    let name = reader.metadata().file_metadata().schema_descr().name().to_owned();
    let projection = Type::group_type_builder(&name).with_fields(fields).build();
    let rows = projection.and_then(|projection| RowIter::from_file_into(Box::new(reader)).project(Some(projection)));
    rows.map_err(|error| cannot(path, &error))
}

/// How many numbers the list in the first row has; `None` where there is no row.
fn first_length(path: &Path, field: &TypePtr) -> Result<Option<usize>, Error> {
    let first = rows(path, vec![field.clone()])?.next().transpose().map_err(|error| cannot(path, &error))?;
    let length = |row: Row| match row.get_column_iter().next() {
        Some((_, Field::ListInternal(list))) => list.elements().len(),
        _ => 0,
    };
    Ok(first.map(length))
}

fn cannot(path: &Path, error: &ParquetError) -> Error {
    Error::Unusable(format!("{}: cannot be read as Parquet: {error}", path.display()))
}
