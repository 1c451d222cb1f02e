//! The messages of MCAP files, one after the other, in the memory that one chunk takes.
use crate::Error;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Longest message [bytes]: a length beyond it is a damaged one.
const LONGEST: usize = 1 << 28;

/// What is asked of the file at a time [bytes].
const READ: usize = 1 << 18;

/// A channel: messages of one type on one topic.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Channel {
    pub topic: String,
    /// `sensor_msgs/msg/JointState`.
    pub type_name: String,
    /// How `definition` is written, `ros2msg`, and how messages are encoded, `cdr`.
    pub encodings: [String; 2],
    /// The message's definition.
    pub definition: Vec<u8>,
}

/// Takes what files hold, in their order. Channels are numbered by their index in the order in which they are met; one that a further file has
/// too keeps its number.
pub(super) trait Visitor {
    fn channel(&mut self, channel: Channel) -> Result<(), Error>;
    /// `time`: when it was logged [ns].
    fn message(&mut self, channel: usize, time: u64, data: &[u8]) -> Result<(), Error>;
}

/// Reads files, each as far as it goes, and says why not to its end where that is so.
///
/// Errors: [`Error::Io`], [`Error::Unusable`] for what is no MCAP file at all, and those of the visitor.
pub(super) fn visit(files: &[PathBuf], visitor: &mut impl Visitor) -> Result<Vec<String>, Error> {
    let mut problems = Vec::new();
    let mut met = Vec::new();
    for file in files {
        let name = file.file_name().filter(|_| files.len() > 1).map(|name| format!("{}: ", name.to_string_lossy()));
        let problem = visit_file(file, &mut met, visitor)?;
        problems.extend(problem.map(|problem| name.unwrap_or_default() + &problem));
    }
    Ok(problems)
}

/// `met`: the channels of the files before, and then those of this one too.
fn visit_file(path: &Path, met: &mut Vec<Channel>, visitor: &mut impl Visitor) -> Result<Option<String>, Error> {
    let mut file = File::open(path).map_err(|source| Error::io(path, source))?;
    let options = LinearReaderOptions::default().with_validate_chunk_crcs(true).with_record_length_limit(LONGEST);
    let mut reader = LinearReader::new_with_options(options);
    let mut known = Known { of_files_before: met.len(), met, schemas: BTreeMap::new(), channels: Vec::new() };
    let mut offset = 0_u64;
    while let Some(event) = reader.next_event() {
        let record = match event {
            Ok(LinearReadEvent::ReadRequest(_)) => {
                let place = reader.insert(READ);
                let read = file.read(place).map_err(|source| Error::io(path, source))?;
                offset += read as u64;
                reader.notify_read(read);
                continue;
            }
            Ok(LinearReadEvent::Record { opcode, data }) => mcap::parse_record(opcode, data),
            Err(error) => Err(error),
        };
        match known.take(record, visitor) {
            Ok(Step::Next) => {}
            Ok(Step::End) => return Ok(None),
            Err(Stop::Visitor(error)) => return Err(error),
            Err(Stop::File(McapError::BadMagic)) => {
                return Err(Error::Unusable(format!("{}: is no MCAP file", path.display())));
            }
            Err(Stop::File(McapError::UnexpectedEof)) => {
                return Ok(Some(format!("is cut off at byte {offset}, and was read up to there")));
            }
            Err(Stop::File(error)) => {
                return Ok(Some(format!("is damaged before byte {offset} ({error}), and was read up to there")));
            }
        }
    }
    Ok(None)
}

enum Step {
    Next,
    End,
}

enum Stop {
    File(McapError),
    Visitor(Error),
}

/// Schemas and channels, by the numbers that the file gives them.
struct Known<'a> {
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    channels: Vec<Option<usize>>,
    met: &'a mut Vec<Channel>,
    of_files_before: usize,
}

impl Known<'_> {
    fn take(&mut self, record: McapResult<Record<'_>>, visitor: &mut impl Visitor) -> Result<Step, Stop> {
        match record.map_err(Stop::File)? {
            Record::Message { header, data } => {
                // A channel that was not introduced is a damaged message.
                if let Some(Some(channel)) = self.channels.get(usize::from(header.channel_id)) {
                    visitor.message(*channel, header.log_time, &data).map_err(Stop::Visitor)?;
                }
            }
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                let id = usize::from(channel.id);
                if self.channels.len() <= id {
                    self.channels.resize(id + 1, None);
                }
                if self.channels[id].is_none() {
                    let (type_name, encoding, definition) =
                        self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    let encodings = [encoding, channel.message_encoding];
                    let channel = Channel { topic: channel.topic, type_name, encodings, definition };
                    let before = self.met[..self.of_files_before].iter().position(|met| *met == channel);
                    self.channels[id] = Some(before.unwrap_or(self.met.len()));
                    if before.is_none() {
                        self.met.push(channel.clone());
                        visitor.channel(channel).map_err(Stop::Visitor)?;
                    }
                }
            }
            Record::DataEnd(_) => return Ok(Step::End),
            _ => {}
        }
        Ok(Step::Next)
    }
}
