//! Several recordings of one rig as one.
use super::names::{Names, natural_order};
use super::same_joints::are_those;
use super::{RecordedCamera, Recording, Sample};
use crate::Error;
use std::path::{Path, PathBuf};

impl Recording {
    /// Reads several recordings of the same rig and joins them in this order.
    ///
    /// All must name the same joints in one order, apart from a prefix or suffix of all of them, and may not contradict one another about a camera.
    /// Joints are called as in the first file. What was commanded in the last
    /// sample of a file does not lead to the first of the next, so it is dropped.
    ///
    /// Errors: those of [`Recording::read`], and [`Error::Unusable`] where two files do not fit together or none is given.
    pub fn read_all(paths: &[PathBuf]) -> Result<Recording, Error> {
        Recording::read_all_with(paths, &mut |path| Recording::read(path))
    }

    /// The same where `read` reads each.
    pub fn read_all_with(
        paths: &[PathBuf],
        read: &mut impl FnMut(&Path) -> Result<Recording, Error>,
    ) -> Result<Recording, Error> {
        let [first, others @ ..] = paths else {
            return Err(Error::Unusable("no recording is given".to_owned()));
        };
        let mut joined = read(first)?;
        // The file from which each camera is known.
        let mut sources = vec![first; joined.cameras.len()];
        for path in others {
            let mut next = read(path)?;
            if next.joints != joined.joints {
                if !are_those(&joined.joints, &next.joints) {
                    let files = format!("{} and {}", first.display(), path.display());
                    return Err(Error::Unusable(format!("{files} {}", other_joints(&joined.joints, &next.joints))));
                }
                next.joints.clone_from(&joined.joints);
            }
            for camera in &next.cameras {
                match joined.cameras.iter().position(|known| known.name == camera.name) {
                    None => sources.push(path),
                    Some(index) => {
                        if let Some(what) = contradiction(&joined.cameras[index], camera) {
                            return Err(Error::Unusable(format!(
                                "{} and {} disagree about camera `{}`: {what}",
                                sources[index].display(),
                                path.display(),
                                camera.name
                            )));
                        }
                        continue;
                    }
                }
                joined.cameras.push(RecordedCamera { name: camera.name.clone(), ..RecordedCamera::default() });
            }
            joined.append(next);
        }
        Ok(joined)
    }

    /// Appends a recording of the same joints and of cameras that are all known here.
    fn append(&mut self, mut next: Recording) {
        let mut names = Names::default();
        let places_here: Vec<u32> = self.features.iter().map(|name| names.intern(name)).collect();
        let places_next: Vec<u32> = next.features.iter().map(|name| names.intern(name)).collect();
        let (features, order) = names.in_natural_order();
        let cameras: Vec<u32> = next.cameras.iter().map(|camera| self.take_in(camera)).collect();
        let sorted = |places: &[u32]| -> Vec<u32> { places.iter().map(|place| order[*place as usize]).collect() };
        for sample in &mut self.samples {
            sample.renumber(&sorted(&places_here));
        }
        for sample in &mut next.samples {
            for camera in sample.cameras_mut() {
                *camera = cameras[*camera as usize];
            }
            sample.renumber(&sorted(&places_next));
        }
        if let Some(last) = self.samples.last_mut() {
            last.joint_action = None;
            last.pose_action = None;
        }
        self.features = features;
        self.samples.append(&mut next.samples);
    }

    /// The index of a camera, of which its lens and its size are noted where they were not known.
    fn take_in(&mut self, camera: &RecordedCamera) -> u32 {
        let index = self.cameras.iter().position(|known| known.name == camera.name).unwrap_or(self.cameras.len());
        if index == self.cameras.len() {
            self.cameras.push(camera.clone());
        }
        self.cameras[index] = self.cameras[index].over(camera);
        index as u32
    }
}

/// How the joints of two files differ, and what would do.
fn other_joints(first: &[String], next: &[String]) -> String {
    let common: Vec<&str> = first.iter().filter(|joint| next.contains(joint)).map(String::as_str).collect();
    let [ours, theirs] =
        [first, next].map(|joints| if joints.is_empty() { "none".to_owned() } else { joints.join(", ") });
    let would_do = match common[..] {
        _ if first.is_empty() || next.is_empty() => String::new(),
        [] => "; where they are of one robot, its joints need the same names in both".to_owned(),
        _ => format!("; --joints {} takes those that both have", common.join(",")),
    };
    format!("are of different robots: joints {ours} and {theirs}{would_do}")
}

impl Sample {
    /// Gives features other indices, by old index, and restores the order.
    pub(super) fn renumber(&mut self, places: &[u32]) {
        for detection in &mut self.pixels {
            detection.feature = places[detection.feature as usize];
        }
        for detection in &mut self.points {
            detection.feature = places[detection.feature as usize];
        }
        self.pixels.sort_unstable_by_key(|detection| (detection.camera, detection.feature));
        self.points.sort_unstable_by_key(|detection| (detection.camera, detection.feature));
        self.targets.sort_by(|a, b| a.camera.cmp(&b.camera).then_with(|| natural_order(&a.target, &b.target)));
    }

    fn cameras_mut(&mut self) -> impl Iterator<Item = &mut u32> {
        let pixels = self.pixels.iter_mut().map(|detection| &mut detection.camera);
        let points = self.points.iter_mut().map(|detection| &mut detection.camera);
        let targets = self.targets.iter_mut().map(|detection| &mut detection.camera);
        pixels.chain(points).chain(targets)
    }
}

/// What two files say differently of a camera.
fn contradiction(a: &RecordedCamera, b: &RecordedCamera) -> Option<String> {
    fn differ<T: PartialEq + std::fmt::Debug>(key: &str, a: &Option<T>, b: &Option<T>) -> Option<String> {
        match (a, b) {
            (Some(a), Some(b)) if a != b => Some(format!("`{key}` is {a:?} and {b:?}")),
            _ => None,
        }
    }
    differ("size", &a.size, &b.size)
        .or_else(|| differ("model", &a.model.map(|model| model.name()), &b.model.map(|model| model.name())))
        .or_else(|| differ("fx", &a.fx, &b.fx))
        .or_else(|| differ("fy", &a.fy, &b.fy))
        .or_else(|| differ("cx", &a.cx, &b.cx))
        .or_else(|| differ("cy", &a.cy, &b.cy))
        .or_else(|| differ("distortion", &a.distortion, &b.distortion))
}
