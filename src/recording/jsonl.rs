//! Recordings as JSON Lines: a header, then one sample a line.
mod entries;
mod header;
mod place;
mod pose;
mod sample;
mod write;

use super::names::Names;
use super::{RecordedCamera, Recording, Sample};
use crate::Error;
use entries::{Entries, Object};
use header::Header;
use sample::SampleEntries;
use serde::de::DeserializeSeed;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Reads a recording sample by sample: an iterator over (line, sample) that ends with the first error.
///
/// Features are numbered in the order in which they are first met, see [`Reader::features`].
pub struct Reader<R> {
    lines: Lines<R>,
    joints: Vec<String>,
    cameras: Vec<RecordedCamera>,
    features: Names,
    has_ended: bool,
}

impl<R: BufRead> Reader<R> {
    /// Reads the header. Messages call the file `file_name`.
    ///
    /// Errors: [`Error::Io`], and [`Error::Malformed`] where the first line is no header.
    pub fn new(input: R, file_name: &str) -> Result<Self, Error> {
        let mut lines = Lines { input, file: file_name.to_owned(), number: 0, text: Vec::new(), is_cut_off: false };
        if !lines.advance()? {
            let problem = format!("is empty, and a recording begins with {}", Header::WHAT);
            return Err(Error::Malformed { file: file_name.to_owned(), line: 1, column: 1, problem });
        }
        let mut header = Header::new();
        lines.read(&mut header)?;
        let Header { joints, cameras, .. } = header;
        Ok(Reader { lines, joints, cameras, features: Names::default(), has_ended: false })
    }

    /// Names of the joints, from base to tip.
    pub fn joints(&self) -> &[String] {
        &self.joints
    }

    /// The cameras that the header names, in its order.
    pub fn cameras(&self) -> &[RecordedCamera] {
        &self.cameras
    }

    /// The features that were met so far; detections refer to them by index.
    pub fn features(&self) -> &[String] {
        &self.features.list
    }

    fn next_sample(&mut self) -> Result<Option<(usize, Sample)>, Error> {
        if !self.lines.advance()? {
            return Ok(None);
        }
        let mut entries = SampleEntries::new(self.joints.len(), &self.cameras, &mut self.features);
        self.lines.read(&mut entries)?;
        let mut sample = entries.sample;
        sample.pixels.sort_unstable_by_key(|detection| (detection.camera, detection.feature));
        sample.points.sort_unstable_by_key(|detection| (detection.camera, detection.feature));
        Ok(Some((self.lines.number, sample)))
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<(usize, Sample), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.has_ended {
            return None;
        }
        let next = self.next_sample().transpose();
        self.has_ended = !matches!(next, Some(Ok(_)));
        next
    }
}

impl Recording {
    /// Reads a recording.
    ///
    /// Errors: [`Error::Io`], and [`Error::Malformed`] for whatever is wrong inside.
    pub fn read(path: &Path) -> Result<Recording, Error> {
        let file = File::open(path).map_err(|source| Error::io(path, source))?;
        Recording::read_from(BufReader::with_capacity(1 << 16, file), &path.display().to_string())
    }

    /// Reads a recording that messages call `file_name`.
    pub fn read_from(input: impl BufRead, file_name: &str) -> Result<Recording, Error> {
        let mut reader = Reader::new(input, file_name)?;
        let mut samples = Vec::new();
        for sample in &mut reader {
            samples.push(sample?.1);
        }
        if samples.is_empty() {
            let problem = "has no samples, only a header".to_owned();
            return Err(Error::Malformed { file: file_name.to_owned(), line: 1, column: 1, problem });
        }
        let (features, places) = reader.features.in_natural_order();
        for sample in &mut samples {
            sample.renumber(&places);
        }
        Ok(Recording { joints: reader.joints, cameras: reader.cameras, features, samples })
    }
}

/// The lines of a file that are not blank.
struct Lines<R> {
    input: R,
    file: String,
    number: usize,
    text: Vec<u8>,
    is_cut_off: bool,
}

impl<R: BufRead> Lines<R> {
    /// Goes on to the next line that is not blank; false at the end.
    fn advance(&mut self) -> Result<bool, Error> {
        const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
        loop {
            self.text.clear();
            let read = self.input.read_until(b'\n', &mut self.text);
            if read.map_err(|source| Error::io(Path::new(&self.file), source))? == 0 {
                return Ok(false);
            }
            self.number += 1;
            if self.number == 1 && self.text.starts_with(BYTE_ORDER_MARK) {
                self.text.drain(..BYTE_ORDER_MARK.len());
            }
            self.is_cut_off = self.text.last() != Some(&b'\n');
            self.text.truncate(self.text.trim_ascii_end().len());
            if !self.text.is_empty() {
                return Ok(true);
            }
        }
    }

    fn read(&self, entries: &mut impl Entries) -> Result<(), Error> {
        let mut json = serde_json::Deserializer::from_slice(&self.text);
        let read = Object(entries).deserialize(&mut json).and_then(|()| json.end());
        read.map_err(|error| place::malformed(&self.file, self.number, &self.text, &error, self.is_cut_off))
    }
}
