//! Tables in Parquet files, with LeRobot's lists of numbers as a column each.
use super::Rows;
use super::lerobot::Info;
use crate::Error;
use parquet::basic::{LogicalType, TimeUnit};
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
    /// Where the number of each column stands.
    places: Vec<Place>,
    fields: Vec<TypePtr>,
    /// Fields that are no numbers.
    left_out: Vec<String>,
    notes: Vec<String>,
    /// Rows of the fields that are wanted, whose indices stand beside; `None` before the first.
    rows: Option<(RowIter<'static>, Vec<usize>)>,
    /// Number of the row that was read last, from 1; 0 before any.
    row: usize,
}

#[derive(Clone, Copy)]
struct Place {
    field: usize,
    /// Which number of the field, where that is a list.
    number: Option<usize>,
    /// The seconds that one unit of a time takes, by the field's type.
    seconds: Option<f64>,
}

/// LeRobot's lists of numbers, which are numbers alone where there is one.
const STATE: &str = "observation.state";
const ACTION: &str = "action";

impl Parquet {
    pub(super) fn open(path: &Path, info: &Info) -> Result<Parquet, Error> {
        let reader = reader(path)?;
        let fields = reader.metadata().file_metadata().schema_descr().root_schema().get_fields().to_vec();
        let (header, places, left_out, notes, rows, row) = Default::default();
        let mut parquet = Parquet { path: path.to_owned(), header, places, fields, left_out, notes, rows, row };
        let length = |name: &str, named: &[String]| -> Result<usize, Error> {
            match parquet.fields.iter().find(|field| field.name() == name) {
                None => Ok(0),
                Some(field) if field.is_primitive() => Ok(1),
                Some(field) => Ok(first_length(path, field)?.unwrap_or(named.len())),
            }
        };
        let lengths = [length(STATE, &info.state)?, length(ACTION, &info.action)?];
        let mut note = |list: &str, length: usize, named: &[String]| {
            if length > 0 && !named.is_empty() && length != named.len() {
                let names = named.join(", ");
                let problem = format!("which meta/info.json names {}: {names}", named.len());
                parquet
                    .notes
                    .push(format!("`{list}` has {length} numbers, {problem}; they are called j1 to j{length}"));
            }
        };
        note(STATE, lengths[0], &info.state);
        note(ACTION, lengths[1], &info.action);
        let fitting = |named: &[String], length: usize| {
            let plain = || (1..=length).map(|number| format!("j{number}")).collect();
            if named.len() == length { named.to_vec() } else { plain() }
        };
        let state = fitting(&info.state, lengths[0]);
        // Targets without names of their own are of the joints in their order.
        let action = fitting(if info.action.is_empty() { &state } else { &info.action }, lengths[1]);
        for (index, field) in parquet.fields.iter().enumerate() {
            let (prefix, names) = match field.name() {
                STATE => ("joints", &state),
                ACTION => ("action", &action),
                name if field.is_primitive() => {
                    parquet.header.push(name.to_owned());
                    parquet.places.push(Place { field: index, number: None, seconds: seconds(field) });
                    continue;
                }
                name => {
                    parquet.left_out.push(name.to_owned());
                    continue;
                }
            };
            for (number, joint) in names.iter().enumerate() {
                parquet.header.push(format!("{prefix}.{joint}"));
                let number = (!field.is_primitive()).then_some(number);
                parquet.places.push(Place { field: index, number, seconds: None });
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
        let mut fields: Vec<usize> = columns.map(|(place, _)| place.field).collect();
        fields.dedup();
        // A projection of nothing is everything.
        let of = if fields.is_empty() { (0..self.fields.len().min(1)).collect() } else { fields };
        let rows = rows(&self.path, of.iter().map(|field| self.fields[*field].clone()).collect())?;
        Ok((rows, of))
    }

    /// The number in a column, NaN where there is none.
    fn number(&self, column: usize, field: &Field) -> Result<f64, Error> {
        let place = self.places[column];
        let field = match (field, place.number) {
            (Field::ListInternal(list), Some(number)) => {
                let length = self.places.iter().filter(|other| other.field == place.field).count();
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
            Field::Long(value) => value as f64 * place.seconds.unwrap_or(1.0),
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
            for column in
                (0..self.places.len()).filter(|column| self.places[*column].field == *field && wanted[*column])
            {
                row[column] = self.number(column, value)?;
            }
        }
        self.rows = Some((rows, fields));
        Ok(true)
    }

    fn is_in_seconds(&self, column: usize) -> bool {
        self.places[column].seconds.is_some()
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn notes(&self) -> &[String] {
        &self.notes
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

/// The seconds that one unit of a field takes, where its type is a time.
fn seconds(field: &Type) -> Option<f64> {
    match field.get_basic_info().logical_type_ref()? {
        LogicalType::Timestamp(time) => Some(match time.unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        }),
        _ => None,
    }
}

fn cannot(path: &Path, error: &ParquetError) -> Error {
    Error::Unusable(format!("{}: cannot be read as Parquet: {error}", path.display()))
}
