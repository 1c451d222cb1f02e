//! What topics a bag has, and which of them are meant.
use super::kinds::Kind;
use super::messages::Channel;
use super::schema::Layout;
use super::value::Value;
use crate::Error;
use std::path::Path;

/// A channel, and how to read it.
pub(super) struct Topic {
    pub name: String,
    pub type_name: String,
    pub kind: Option<Kind>,
    layout: Result<Layout, String>,
    /// Of what tells whether a message says again what was said before, where whole messages need not be looked at.
    head: Option<Layout>,
    pub messages: usize,
}

impl Topic {
    pub(super) fn new(channel: Channel) -> Self {
        let Channel { topic, type_name, encodings, definition } = channel;
        let kind = Kind::of(&type_name);
        let layout = match (kind, encodings.each_ref().map(String::as_str)) {
            (None, _) => Err("is of no type that recordings are made of".to_owned()),
            (Some(kind), ["ros2msg", "cdr"]) => Layout::new(&type_name, &definition, kind.wanted()),
            (Some(_), [schema, message]) => {
                Err(format!("has a schema in `{schema}` and messages in `{message}`, and `ros2msg` and `cdr` are read"))
            }
        };
        let of_head = match kind {
            Some(Kind::CameraInfo) => Some("header.frame_id"),
            Some(Kind::JointStates) => Some("name"),
            _ => None,
        };
        let head = of_head.filter(|_| layout.is_ok());
        let head = head.and_then(|field| Layout::new(&type_name, &definition, &[field]).ok());
        Topic { name: topic, type_name, kind, layout, head, messages: 0 }
    }

    /// What `take` makes of a message's head; `None` where it cannot be read by itself.
    pub(super) fn decode_head<T>(&self, data: &[u8], take: impl FnOnce(&Value) -> T) -> Option<T> {
        Value::decode(self.head.as_ref()?, data).ok().map(|value| take(&value))
    }

    /// Decodes a message, of which `take` makes something.
    ///
    /// Errors: [`Error::Unusable`] with file, topic, and number and time of the message.
    pub(super) fn decode<T>(
        &self,
        path: &Path,
        time: u64,
        data: &[u8],
        take: impl FnOnce(&Value) -> Result<T, String>,
    ) -> Result<T, Error> {
        let layout = self.layout.as_ref().map_err(String::clone);
        let taken = layout.and_then(|layout| Value::decode(layout, data)).and_then(|value| take(&value));
        taken.map_err(|problem| {
            let (file, topic, seconds, nanoseconds) =
                (path.display(), &self.name, time / 1_000_000_000, time % 1_000_000_000);
            let number = self.messages;
            Error::Unusable(format!(
                "{file}: {topic} ({}): message {number}, logged at {seconds}.{nanoseconds:09} s, {problem}",
                self.type_name
            ))
        })
    }

    /// Its name without the last part, `/left/tags` and `/left/image_raw/compressed` -> `left`; empty where it has no other.
    pub(super) fn namespace(&self) -> &str {
        let name = self.name.trim_start_matches('/');
        let image = name.strip_suffix("/compressed").unwrap_or(name);
        image.rsplit_once('/').map_or("", |(namespace, _)| namespace)
    }

    /// True for `/left/image_rect`, `/left/image_rect_color/compressed` and what else stands below such a name: images without distortion.
    pub(super) fn is_rectified(&self) -> bool {
        self.name.split('/').any(|part| part.starts_with("image_rect"))
    }
}

/// What there is, for messages about what there is not.
pub(super) fn list(topics: &[Topic]) -> String {
    let topic = |topic: &Topic| format!("{} ({}, {} messages)", topic.name, topic.type_name, topic.messages);
    let topics: Vec<String> = topics.iter().map(topic).collect();
    if topics.is_empty() { "nothing".to_owned() } else { topics.join(", ") }
}

/// The name of the topic of one kind: the one that is named, or the only one that there is; `None` where there is none.
///
/// Errors: [`Error::Unusable`] where there are several, or none of that name.
pub(super) fn choose<'a>(
    topics: &'a [Topic],
    kind: Kind,
    named: Option<&str>,
    option: &str,
    path: &Path,
) -> Result<Option<&'a str>, Error> {
    let of_kind = topics.iter().filter(|topic| topic.kind == Some(kind) && topic.messages > 0);
    let mut names: Vec<&str> = of_kind.map(|topic| topic.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let file = path.display();
    match named {
        Some(named) => match names.iter().find(|name| is_topic(name, named)) {
            Some(name) => Ok(Some(name)),
            None => Err(Error::Unusable(format!(
                "{file}: {option} names `{named}`, on which there are no such messages; there are {}",
                list(topics)
            ))),
        },
        None => match names.as_slice() {
            [] => Ok(None),
            [name] => Ok(Some(name)),
            _ => Err(Error::Unusable(format!(
                "{file}: there are several topics of a kind, and {option} has to name one of {}",
                names.join(", ")
            ))),
        },
    }
}

/// True where a topic is the one that was named, with its leading `/` or without.
pub(super) fn is_topic(topic: &str, named: &str) -> bool {
    topic.trim_start_matches('/') == named.trim_start_matches('/')
}
