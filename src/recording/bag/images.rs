//! The first pass over a bag: what images show, and what is said of cameras.
use super::BagOptions;
use super::cameras::Info;
use super::kinds::{Kind, features, frame, stamp};
use super::messages::{Channel, Visitor};
use super::topics::{Topic, is_topic};
use crate::Error;
use crate::recording::names::Names;
use std::collections::BTreeMap;
use std::path::Path;

/// What one message says of one image.
pub(super) struct Image {
    /// [ns]
    pub stamp: i64,
    /// Index of its source.
    pub source: usize,
    /// By index, with the pixel.
    pub features: Vec<(u32, [f64; 2])>,
}

/// A topic (by index) and a frame: images of one camera.
pub(super) type Source = (usize, String);

/// What the first pass finds.
pub(super) struct Images<'a> {
    path: &'a Path,
    options: &'a BagOptions,
    pub topics: Vec<Topic>,
    pub images: Vec<Image>,
    pub features: Names,
    pub sources: Vec<Source>,
    pub infos: BTreeMap<Source, Info>,
    /// Pixels that are no numbers.
    pub not_finite: usize,
}

impl<'a> Images<'a> {
    pub(super) fn new(path: &'a Path, options: &'a BagOptions) -> Self {
        Images {
            path,
            options,
            topics: Vec::new(),
            images: Vec::new(),
            features: Names::default(),
            sources: Vec::new(),
            infos: BTreeMap::new(),
            not_finite: 0,
        }
    }

    fn is_meant(&self, topic: &str) -> bool {
        let named = &self.options.camera_topics;
        named.is_empty() || named.iter().any(|(known, _)| is_topic(topic, known))
    }

    fn source(&mut self, channel: usize, frame: &str) -> usize {
        let known = self.sources.iter().position(|(topic, known)| *topic == channel && known == frame);
        known.unwrap_or_else(|| {
            self.sources.push((channel, frame.to_owned()));
            self.sources.len() - 1
        })
    }
}

impl Visitor for Images<'_> {
    fn channel(&mut self, channel: Channel) -> Result<(), Error> {
        self.topics.push(Topic::new(channel));
        Ok(())
    }

    fn message(&mut self, channel: usize, time: u64, data: &[u8]) -> Result<(), Error> {
        self.topics[channel].messages += 1;
        let topic = &self.topics[channel];
        match topic.kind {
            Some(kind) if kind.is_of_images() && self.is_meant(&topic.name) => {
                let (stamp, frame, seen) = topic.decode(self.path, time, data, |message| {
                    Ok((stamp(message)?, frame(message).to_owned(), features(kind, message)?))
                })?;
                let source = self.source(channel, &frame);
                let number = seen.len();
                let is_finite = |pixel: &[f64; 2]| pixel.iter().all(|number| number.is_finite());
                let seen = seen.into_iter().filter(|(_, pixel)| is_finite(pixel));
                let features: Vec<_> = seen.map(|(name, pixel)| (self.features.intern(&tidy(&name)), pixel)).collect();
                self.not_finite += number - features.len();
                self.images.push(Image { stamp, source, features });
            }
            Some(Kind::CameraInfo) => {
                let (frame, info) = topic
                    .decode(self.path, time, data, |message| Ok((frame(message).to_owned(), Info::read(message)?)))?;
                self.infos.entry((channel, frame)).or_insert(info);
            }
            _ => {}
        }
        Ok(())
    }
}

/// A name without what parameter paths cannot hold.
pub(super) fn tidy(name: &str) -> String {
    let name = name.replace(|c: char| c == '.' || c == '*' || c.is_control(), "_");
    if name.is_empty() { "unnamed".to_owned() } else { name }
}
