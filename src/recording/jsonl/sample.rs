//! A line of a recording: one sample.
use super::entries::{Entries, Keys, List, Number, Numbers, Object};
use super::pose::{read_noisy_pose, read_pose};
use crate::error::suggestion;
use crate::recording::names::{Names, natural_order};
use crate::recording::{Detection, PointDetection, RecordedCamera, Sample, TargetDetection};
use crate::rig::problem_of_name;
use handeye_solvers::Pose;
use nalgebra::Matrix6;
use serde::de::MapAccess;
use std::collections::BTreeSet;

/// Reads a sample, with features numbered in the order in which they were first met.
pub(super) struct SampleEntries<'a> {
    pub(super) sample: Sample,
    n_joints: usize,
    cameras: &'a [RecordedCamera],
    features: &'a mut Names,
    keys: Keys,
}

impl<'a> SampleEntries<'a> {
    pub(super) fn new(n_joints: usize, cameras: &'a [RecordedCamera], features: &'a mut Names) -> Self {
        let keys = Keys::new(&["time", "joints", "pose", "joint_action", "pose_action", "pixels", "points", "targets"]);
        SampleEntries { sample: Sample::default(), n_joints, cameras, features, keys }
    }
}

impl Entries for SampleEntries<'_> {
    type Key = &'static str;
    const WHAT: &'static str = "a sample {\"time\":0.0,...}";

    fn key(&mut self, name: &str) -> Result<&'static str, String> {
        self.keys.meet(name)
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, key: &'static str, map: &mut A) -> Result<(), A::Error> {
        let n_joints = self.n_joints;
        let one_per_joint = |numbers: Vec<f64>| match numbers.len() {
            found if found == n_joints => Ok(Some(numbers)),
            found if key == "joints" => Err(format!("sample has {found} joints, the header names {n_joints}")),
            found => Err(format!("`{key}` has {found} joints, the header names {n_joints}")),
        };
        match key {
            "time" => self.sample.time = map.next_value_seed(Number(|time| Ok(Some(time))))?,
            "joints" => self.sample.joints = map.next_value_seed(List(one_per_joint))?,
            "joint_action" => self.sample.joint_action = map.next_value_seed(List(one_per_joint))?,
            "pose" => self.sample.pose = Some(read_pose(map)?),
            "pose_action" => self.sample.pose_action = Some(read_pose(map)?),
            "pixels" => {
                let mut seen = self.seen();
                map.next_value_seed(Object(&mut seen))?;
                let detection = |(camera, feature, pixel)| Detection { camera, feature, pixel };
                self.sample.pixels = seen.found.into_iter().map(detection).collect();
            }
            "points" => {
                let mut seen = self.seen();
                map.next_value_seed(Object(&mut seen))?;
                let detection = |(camera, feature, point)| PointDetection { camera, feature, point };
                self.sample.points = seen.found.into_iter().map(detection).collect();
            }
            _ => {
                let mut targets = Names::default();
                let mut seen =
                    ByCamera { cameras: self.cameras, names: &mut targets, met: BTreeSet::new(), found: vec![] };
                map.next_value_seed(Object(&mut seen))?;
                let found = seen.found;
                let detection = |(camera, target, (pose, covariance)): (u32, u32, (Pose, Option<Matrix6<f64>>))| {
                    let target = targets.list[target as usize].clone();
                    TargetDetection { camera, target, pose, covariance }
                };
                self.sample.targets = found.into_iter().map(detection).collect();
                self.sample
                    .targets
                    .sort_by(|a, b| a.camera.cmp(&b.camera).then_with(|| natural_order(&a.target, &b.target)));
            }
        }
        Ok(())
    }
}

impl SampleEntries<'_> {
    fn seen<L>(&mut self) -> ByCamera<'_, L> {
        ByCamera { cameras: self.cameras, names: self.features, met: BTreeSet::new(), found: Vec::new() }
    }
}

/// Camera -> name -> where it was seen.
struct ByCamera<'a, L> {
    cameras: &'a [RecordedCamera],
    names: &'a mut Names,
    met: BTreeSet<u32>,
    found: Vec<(u32, u32, L)>,
}

impl<L: Leaf> Entries for ByCamera<'_, L> {
    type Key = u32;
    const WHAT: &'static str = "a table by camera";

    fn key(&mut self, name: &str) -> Result<u32, String> {
        let Some(index) = self.cameras.iter().position(|camera| camera.name == name) else {
            let known = self.cameras.iter().map(|camera| camera.name.as_str());
            return Err(format!("the header names no camera `{name}` {}", suggestion(name, known)));
        };
        if !self.met.insert(index as u32) {
            return Err(format!("camera `{name}` is given twice"));
        }
        Ok(index as u32)
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, camera: u32, map: &mut A) -> Result<(), A::Error> {
        map.next_value_seed(Object(&mut OfCamera {
            camera,
            names: self.names,
            met: BTreeSet::new(),
            found: &mut self.found,
        }))
    }
}

/// Name -> where one camera saw it.
struct OfCamera<'a, L> {
    camera: u32,
    names: &'a mut Names,
    met: BTreeSet<u32>,
    found: &'a mut Vec<(u32, u32, L)>,
}

impl<L: Leaf> Entries for OfCamera<'_, L> {
    type Key = u32;
    const WHAT: &'static str = "a table of what the camera saw";

    fn key(&mut self, name: &str) -> Result<u32, String> {
        let index = match self.names.index(name) {
            Some(index) => index,
            None => problem_of_name(name).map_or_else(|| Ok(self.names.intern(name)), Err)?,
        };
        if !self.met.insert(index) {
            return Err(format!("`{name}` is given twice"));
        }
        Ok(index)
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, name: u32, map: &mut A) -> Result<(), A::Error> {
        self.found.push((self.camera, name, L::read(map)?));
        Ok(())
    }
}

/// What a camera says of a thing that it saw.
trait Leaf: Sized {
    fn read<'de, A: MapAccess<'de>>(map: &mut A) -> Result<Self, A::Error>;
}

impl<const N: usize> Leaf for [f64; N] {
    fn read<'de, A: MapAccess<'de>>(map: &mut A) -> Result<Self, A::Error> {
        map.next_value_seed(Numbers(Ok))
    }
}

impl Leaf for (Pose, Option<Matrix6<f64>>) {
    fn read<'de, A: MapAccess<'de>>(map: &mut A) -> Result<Self, A::Error> {
        read_noisy_pose(map)
    }
}
