//! Tables in CSV files.
use super::Rows;
use super::columns::IMAGES;
use crate::Error;
use csv::{ReaderBuilder, StringRecord};
use std::path::Path;

/// A CSV file in memory, read row by row.
pub(super) struct Csv {
    file: String,
    text: String,
    separator: u8,
    header: Vec<String>,
    records: csv::StringRecordsIntoIter<std::io::Cursor<Vec<u8>>>,
    /// The row that was read last.
    record: StringRecord,
}

/// What values may be apart by; that which the header has most of counts.
const SEPARATORS: [u8; 3] = *b",;\t";

/// What stands for a number that was not measured, beside nothing at all.
const MISSING: &[&str] = &["nan", "null", "none", "na", "n/a"];

impl Csv {
    pub(super) fn open(path: &Path) -> Result<Csv, Error> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, source))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let before = String::from_utf8_lossy(&error.as_bytes()[..valid]).into_owned();
            Error::at(&file, &before, valid, "this is no UTF-8 text".to_owned())
        })?;
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        let is_header = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
        let first = text.lines().find(is_header).unwrap_or_default();
        let count = |separator: &u8| first.bytes().filter(|byte| byte == separator).count();
        // Of equals the first.
        let separator = SEPARATORS.into_iter().rev().max_by_key(count).unwrap_or(b',');
        let mut reader = ReaderBuilder::new()
            .delimiter(separator)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(std::io::Cursor::new(text.clone().into_bytes()));
        let record = reader.headers().cloned().unwrap_or_default();
        let header: Vec<String> = record.iter().map(str::to_owned).collect();
        if header.iter().all(String::is_empty) {
            let problem = "is empty, and a table begins with the names of its columns".to_owned();
            return Err(Error::Malformed { file, line: 1, column: 1, problem });
        }
        Ok(Csv { file, text, separator, header, records: reader.into_records(), record })
    }

    /// Where a value of the last row begins in the text.
    fn offset(&self, column: usize) -> usize {
        let mut start = self.record.position().map_or(0, |position| position.byte() as usize).min(self.text.len());
        // Lines that are blank or comments may stand before the row.
        for line in self.text[start..].split_inclusive('\n') {
            if !line.trim().is_empty() && !line.starts_with('#') {
                break;
            }
            start += line.len();
        }
        let mut is_quoted = false;
        let mut separators = self.text.bytes().enumerate().skip(start).filter(|&(_, byte)| {
            is_quoted ^= byte == b'"';
            byte == self.separator && !is_quoted
        });
        let before = column.checked_sub(1).and_then(|before| separators.nth(before));
        let value = before.map_or(start, |(separator, _)| separator + 1);
        self.text.len() - self.text[value..].trim_start_matches(' ').len()
    }
}

impl Rows for Csv {
    fn header(&self) -> &[String] {
        &self.header
    }

    fn next(&mut self, wanted: &[bool], row: &mut Vec<f64>) -> Result<bool, Error> {
        row.clear();
        match self.records.next() {
            None => return Ok(false),
            Some(Ok(record)) => self.record = record,
            Some(Err(error)) => {
                let at = error.position().map_or(0, |position| position.byte() as usize);
                let problem = match error.kind() {
                    csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                        format!("this row has {len} values, and the header names {expected_len}")
                    }
                    _ => error.to_string(),
                };
                return Err(Error::at(&self.file, &self.text, at, problem));
            }
        }
        for (column, value) in self.record.iter().enumerate() {
            let is_missing = value.is_empty() || MISSING.iter().any(|missing| value.eq_ignore_ascii_case(missing));
            if is_missing || wanted.get(column) != Some(&true) {
                row.push(f64::NAN);
                continue;
            }
            match value.parse::<f64>() {
                Ok(number) if number.is_finite() => row.push(number),
                _ => return Err(self.error(column, format!("`{value}` is no number"))),
            }
        }
        Ok(true)
    }

    fn image(&self) -> Option<&str> {
        let column = self.header.iter().position(|name| IMAGES.contains(&name.as_str()))?;
        Path::new(self.record.get(column)?).file_stem().map_or(Some(""), |stem| stem.to_str())
    }

    fn error(&self, column: usize, problem: String) -> Error {
        Error::at(&self.file, &self.text, self.offset(column), problem)
    }

    fn file(&self) -> String {
        self.file.clone()
    }
}
