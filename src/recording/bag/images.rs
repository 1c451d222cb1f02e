//! The first pass over a bag: what images show, what is said of cameras, and which joints there are.
use super::cameras::Info;
use super::joints::JointLists;
use super::kinds::{Kind, features, frame, need, stamp};
use super::labels::Labels;
use super::messages::{Channel, Visitor};
use super::topics::{Topic, is_topic};
use super::{BagOptions, Detect, Found};
use crate::Error;
use crate::recording::clock::seconds;
use crate::recording::groups::Image;
use crate::recording::px;
use std::collections::BTreeMap;
use std::path::Path;

/// A topic (by index) and a frame: images of one camera.
pub(super) type Source = (usize, String);

/// A CameraInfo, or why it is none: that matters where it is of images.
type Said = Result<Info, Error>;

/// A PNG or JPEG, and where it belongs.
struct Pending {
    stamp: i64,
    source: usize,
    bytes: Vec<u8>,
}

/// Images that are looked at together, so that several cores have work and memory stays bounded.
const TOGETHER: usize = 32;

/// What the first pass finds.
pub(super) struct Images<'a> {
    path: &'a Path,
    options: &'a BagOptions,
    pub topics: Vec<Topic>,
    pub images: Vec<Image>,
    pub features: Labels,
    pub sources: Vec<Source>,
    /// The size of each source's images, where they were looked at.
    pub sizes: BTreeMap<usize, [u32; 2]>,
    pub infos: BTreeMap<Source, Said>,
    pub joints: JointLists,
    /// Of the last image, whose memory the next one takes.
    seen: Vec<(u32, [f64; 2])>,
    /// Pixels that are no numbers.
    pub not_finite: usize,
    /// Looks for features in images; where it is not given, those of detectors' messages are taken.
    detect: Option<&'a mut Detect<'a>>,
    pending: Vec<Pending>,
    /// Images that cannot be decoded, and why not the first.
    undecoded: (usize, String),
}

impl<'a> Images<'a> {
    pub(super) fn new(path: &'a Path, options: &'a BagOptions, detect: Option<&'a mut Detect<'a>>) -> Self {
        Images {
            path,
            options,
            topics: Vec::new(),
            images: Vec::new(),
            features: Labels::default(),
            sources: Vec::new(),
            sizes: BTreeMap::new(),
            infos: BTreeMap::new(),
            joints: JointLists::default(),
            seen: Vec::new(),
            not_finite: 0,
            detect,
            pending: Vec::new(),
            undecoded: (0, String::new()),
        }
    }

    /// Looks at the images that wait, and says how many could not be looked at so far.
    pub(super) fn finish(&mut self) -> Result<Option<String>, Error> {
        self.look()?;
        let (count, why) = &self.undecoded;
        Ok((*count > 0).then(|| format!("{count} images are left out, the first of which {why}")))
    }

    /// Errors: [`Error::Unusable`] for an image of another size than those before it.
    fn look(&mut self) -> Result<(), Error> {
        let Some(detect) = &mut self.detect else { return Ok(()) };
        let pending = std::mem::take(&mut self.pending);
        let bytes: Vec<&[u8]> = pending.iter().map(|image| image.bytes.as_slice()).collect();
        let found = detect(&bytes);
        for (Pending { stamp, source, .. }, found) in pending.iter().zip(found) {
            match found {
                Ok(Found { size, features }) => {
                    let known = *self.sizes.entry(*source).or_insert(size);
                    if known != size {
                        let (file, topic) = (self.path.display(), &self.topics[self.sources[*source].0].name);
                        let seconds = seconds(*stamp);
                        return Err(Error::Unusable(format!(
                            "{file}: {topic}: the image of {seconds:.6} s is of {}, and those before are of {}",
                            px(size),
                            px(known)
                        )));
                    }
                    let features =
                        features.iter().map(|(name, pixel)| (self.features.names.intern(name), *pixel)).collect();
                    self.images.push(Image { stamp: *stamp, source: *source, features });
                }
                Err(why) => {
                    if self.undecoded.0 == 0 {
                        self.undecoded.1 = why;
                    }
                    self.undecoded.0 += 1;
                }
            }
        }
        Ok(())
    }

    fn is_meant(&self, topic: &str) -> bool {
        let named = &self.options.camera_topics;
        named.is_empty() || named.iter().any(|(known, _)| is_topic(topic, known))
    }
}

/// The index of a source, which is added where it is new.
fn source(sources: &mut Vec<Source>, channel: usize, frame: &str) -> usize {
    let known = sources.iter().position(|(topic, known)| *topic == channel && known == frame);
    known.unwrap_or_else(|| {
        sources.push((channel, frame.to_owned()));
        sources.len() - 1
    })
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
            Some(Kind::CompressedImage) if self.detect.is_some() && self.is_meant(&topic.name) => {
                let image = topic.decode(self.path, time, data, |message| {
                    let bytes = need(message.bytes("data"), "data")?.to_vec();
                    Ok(Pending {
                        stamp: stamp(message)?,
                        source: source(&mut self.sources, channel, frame(message)),
                        bytes,
                    })
                })?;
                self.pending.push(image);
                if self.pending.len() >= TOGETHER {
                    self.look()?;
                }
            }
            Some(kind) if kind.is_of_images() && self.detect.is_none() && self.is_meant(&topic.name) => {
                let seen = &mut self.seen;
                seen.clear();
                let (stamp, source) = topic.decode(self.path, time, data, |message| {
                    features(kind, message, &mut |label, pixel| match pixel.iter().all(|number| number.is_finite()) {
                        true => seen.push((self.features.index(label), pixel)),
                        false => self.not_finite += 1,
                    })?;
                    Ok((stamp(message)?, source(&mut self.sources, channel, frame(message))))
                })?;
                // As long as it is, and no longer.
                self.images.push(Image { stamp, source, features: seen.as_slice().to_vec() });
            }
            Some(Kind::JointStates) => {
                if topic.decode_head(data, |state| self.joints.has(&topic.name, state)) == Some(true) {
                    return Ok(());
                }
                // What cannot be read is told by whoever needs it.
                let _ = topic.decode(self.path, time, data, |state| {
                    self.joints.add(&topic.name, state);
                    Ok(())
                });
            }
            Some(Kind::CameraInfo) => {
                // It is said again with every image.
                let is_known = |of: &str| self.infos.keys().any(|(known, frame)| *known == channel && frame == of);
                if topic.decode_head(data, |message| is_known(frame(message))) == Some(true) {
                    return Ok(());
                }
                let mut of = String::new();
                let info = topic.decode(self.path, time, data, |message| {
                    frame(message).clone_into(&mut of);
                    Info::read(message)
                });
                self.infos.entry((channel, of)).or_insert(info);
            }
            _ => {}
        }
        Ok(())
    }
}
