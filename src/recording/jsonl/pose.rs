//! A pose in a recording: `{"xyz":[x,y,z],"quat":[x,y,z,w]}`, or with `"rpy"` in place of `"quat"`.
use super::entries::{Entries, Keys, Numbers, Object};
use crate::rig::rotations;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use serde::de::MapAccess;

/// Reads the pose that is the next value.
pub(super) fn read_pose<'de, A: MapAccess<'de>>(map: &mut A) -> Result<Pose, A::Error> {
    let mut entries = PoseEntries { keys: Keys::new(&["xyz", "quat", "rpy"]), xyz: [0.0; 3], rotation: None };
    map.next_value_seed(Object(&mut entries))?;
    Ok(Pose { rotation: entries.rotation.unwrap_or_else(Matrix3::identity), translation: Vector3::from(entries.xyz) })
}

struct PoseEntries {
    keys: Keys,
    xyz: [f64; 3],
    rotation: Option<Matrix3<f64>>,
}

impl Entries for PoseEntries {
    type Key = &'static str;
    const WHAT: &'static str = "a pose {\"xyz\":[x,y,z],\"quat\":[x,y,z,w]}";

    fn key(&mut self, name: &str) -> Result<&'static str, String> {
        let key = self.keys.meet(name)?;
        if key != "xyz" && self.rotation.is_some() {
            return Err("the rotation is given twice: `quat` or `rpy`, not both".to_owned());
        }
        Ok(key)
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, key: &'static str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "xyz" => self.xyz = map.next_value_seed(Numbers(Ok))?,
            "rpy" => self.rotation = map.next_value_seed(Numbers(|rpy| Ok(Some(rotations::from_rpy(rpy)))))?,
            _ => {
                self.rotation = map.next_value_seed(Numbers(|quat| {
                    let rotation = rotations::from_quaternion(quat);
                    rotation.map(Some).ok_or_else(|| {
                        "a quaternion of length 0 is no rotation (none is [0,0,0,1]; what was not measured is left out)".to_owned()
                    })
                }))?;
            }
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), String> {
        if self.keys.has("xyz") && self.rotation.is_some() {
            Ok(())
        } else {
            Err(format!("this is not {}", Self::WHAT))
        }
    }
}
