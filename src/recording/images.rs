//! What images show, with where the robot was at the time.
use super::actions::take_actions;
use super::at_times::{Moment, at_times, whereabouts};
use super::clock::nanoseconds;
use super::groups::{Group, Image, groups, moments, samples, split};
use super::names::Names;
use super::whereabouts::note_on_apart;
use super::{RecordedCamera, Recording, Sample};
use std::collections::{BTreeMap, BTreeSet};

/// What one image shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSeen {
    /// Index of its camera.
    pub camera: u32,
    /// The name of its file, without folder and ending: images of several cameras with one name belong together.
    pub name: String,
    /// When it was taken [s].
    pub time: Option<f64>,
    /// Names and pixels of features.
    pub features: Vec<(String, [f64; 2])>,
}

/// How images find the rows of a recording that says where the robot was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairing {
    /// The first names with the first row: there are as many rows as names.
    Order,
    /// By the name that each row has.
    Name,
    /// By time, interpolated between rows.
    Time,
}

/// Where the robot was when images were taken.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    /// Their joints, poses and actions; the rest is nothing to images.
    pub states: &'a Recording,
    /// The name of the image that each goes with, for [`Pairing::Name`].
    pub names: &'a [String],
    /// How images find them.
    pub pairing: Pairing,
}

impl Recording {
    /// Joins images with the joints, poses and actions of rows.
    ///
    /// Images that show nothing are left out, with their rows. By [`Pairing::Time`] images of several cameras make one sample where their times
    /// are within half the time between two images of one camera and the robot did not move between them; otherwise where they have one name. Without rows, samples are in the order
    /// of `images`, whose names come in their order.
    ///
    /// Returned are the recording, without samples where no image shows anything, and notes. Errors: what does not fit, in words.
    pub fn from_images(
        cameras: Vec<RecordedCamera>,
        images: &[ImageSeen],
        rows: Option<Rows>,
    ) -> Result<(Recording, Vec<String>), String> {
        let by_time = rows.is_some_and(|rows| rows.pairing == Pairing::Time);
        let order = in_order_of_names(images);
        let stamps = if by_time { times(images)? } else { numbers(images, &order) };
        let mut features = Names::default();
        let stamped: Vec<Image> = images
            .iter()
            .zip(stamps)
            .map(|(image, stamp)| {
                let features = image.features.iter().map(|(name, pixel)| (features.intern(name), *pixel)).collect();
                Image { stamp, source: image.camera as usize, features }
            })
            .collect();
        let camera_of_source: Vec<u32> = (0..cameras.len() as u32).collect();
        let groups = groups(&stamped, &camera_of_source, (!by_time).then_some(0));
        let mut notes = Vec::new();
        let (groups, at) = match rows.filter(|_| by_time) {
            Some(Rows { states, .. }) => {
                let (whereabouts, spans) = whereabouts(moments(&groups, &stamped), states);
                let (groups, apart) = split(groups, &stamped, |first, last| whereabouts.moved(first, last));
                notes.extend(note_on_apart(apart));
                let whereabouts = whereabouts.of(&groups);
                (groups, Some((whereabouts, spans)))
            }
            None => (groups, None),
        };
        notes.extend(note_on_blank(images, &cameras));
        let found = match (rows, at) {
            (None, _) => groups.iter().map(|_| Sample::default()).collect(),
            (Some(Rows { states, .. }), Some((whereabouts, spans))) => {
                let moment = |group: &Group| Moment { name: &images[group.images[0]].name, time: group.time };
                let moments: Vec<Moment> = groups.iter().map(moment).collect();
                at_times(&moments, whereabouts, spans, states, &mut notes)?
            }
            (Some(Rows { states, names, pairing }), None) => {
                let rows = match pairing {
                    Pairing::Name => by_name(&groups, &order, states, names)?,
                    _ => in_order(&groups, order.len(), states)?,
                };
                let mut samples: Vec<Sample> = rows.iter().map(|row| states.samples[*row].clone()).collect();
                let rows: Vec<Option<usize>> = rows.into_iter().map(Some).collect();
                take_actions(&mut samples, &rows, states, pairing, &mut notes);
                samples
            }
        };
        let states = found.iter().map(|_| (None, None));
        let (of_images, features, _) = samples(&groups, stamped, features, &camera_of_source, states);
        let join = |(Sample { time, pixels, .. }, row): (Sample, Sample)| Sample {
            time: if by_time { time } else { row.time },
            pixels,
            points: Vec::new(),
            targets: Vec::new(),
            ..row
        };
        let samples: Vec<Sample> = of_images.into_iter().zip(found).map(join).collect();
        let joints = rows.map_or_else(Vec::new, |rows| rows.states.joints.clone());
        let recording = Recording { joints, cameras, features, samples };
        if recording.samples.is_empty() {
            return Ok((recording, notes));
        }
        Ok((recording.checked().map_err(|error| error.to_string())?, notes))
    }
}

/// Images that show nothing, by their names: samples are numbered without them.
fn note_on_blank(images: &[ImageSeen], cameras: &[RecordedCamera]) -> Option<String> {
    let blank: Vec<&ImageSeen> = images.iter().filter(|image| image.features.is_empty()).collect();
    let name = |image: &&ImageSeen| match cameras.get(image.camera as usize).filter(|_| cameras.len() > 1) {
        Some(camera) => format!("{} of {}", image.name, camera.name),
        None => image.name.clone(),
    };
    let mut names: Vec<String> = blank.iter().take(NAMED).map(name).collect();
    if blank.len() > NAMED {
        names.push(format!("{} more", blank.len() - NAMED));
    }
    let (count, of) = (blank.len(), images.len());
    let names = names.join(", ");
    (count > 0).then(|| {
        format!(
            "{count} of {of} images show nothing of what is looked for ({names}); samples are numbered from 0, without those of which no image does"
        )
    })
}

/// Images that a note names.
const NAMED: usize = 12;

/// The names of all images, each once.
fn in_order_of_names(images: &[ImageSeen]) -> Vec<&str> {
    let mut met = BTreeSet::new();
    images.iter().map(|image| image.name.as_str()).filter(|name| met.insert(*name)).collect()
}

/// The times of images [ns].
fn times(images: &[ImageSeen]) -> Result<Vec<i64>, String> {
    let time = |image: &ImageSeen| {
        let seconds = image.time.ok_or_else(|| {
            let name = &image.name;
            format!("the name of image `{name}` is no time, in seconds or as a count of ms, µs or ns since 1970 as all others are; by order or name they might pair")
        })?;
        Ok(nanoseconds(seconds))
    };
    images.iter().map(time).collect()
}

/// In place of times the number of each image's name in their order: images of one name are then at the same time, and no others.
fn numbers(images: &[ImageSeen], order: &[&str]) -> Vec<i64> {
    let numbers: BTreeMap<&str, i64> = order.iter().enumerate().map(|(number, name)| (*name, number as i64)).collect();
    images.iter().map(|image| numbers[image.name.as_str()]).collect()
}

/// For each group, whose time is the number of its name, the row of that number.
fn in_order(groups: &[Group], names: usize, states: &Recording) -> Result<Vec<usize>, String> {
    let rows = states.samples.len();
    if rows != names {
        return Err(format!(
            "there are {names} images of each camera and {rows} rows, which do not pair in order (by name or time they might)"
        ));
    }
    Ok(groups.iter().map(|group| group.time as usize).collect())
}

/// For each group the row that has its name.
fn by_name(groups: &[Group], order: &[&str], states: &Recording, names: &[String]) -> Result<Vec<usize>, String> {
    if names.len() != states.samples.len() {
        return Err("no row says which image it goes with, as a column `image` of a CSV file would; by order or time they might pair".to_owned());
    }
    let mut rows = BTreeMap::new();
    for (row, name) in names.iter().enumerate() {
        if !name.is_empty() && rows.insert(name.as_str(), row).is_some() {
            return Err(format!("two rows are of the image `{name}`"));
        }
    }
    let row = |group: &Group| {
        let name = order[group.time as usize];
        rows.get(name).copied().ok_or_else(|| format!("no row is of the image `{name}`"))
    };
    groups.iter().map(row).collect()
}
