//! A pose in a recording: `{"xyz":[x,y,z],"quat":[x,y,z,w]}`, or with `"rpy"` in place of `"quat"`.
use super::entries::{Entries, Keys, Numbers, Object};
use crate::geometry::orientation;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::de::MapAccess;

/// Reads the pose that is the next value.
pub(super) fn read_pose<'de, A: MapAccess<'de>>(map: &mut A) -> Result<Pose, A::Error> {
    let mut entries = PoseEntries::new(&["xyz", "quat", "rpy"]);
    map.next_value_seed(Object(&mut entries))?;
    Ok(entries.pose())
}

/// The same with the covariance of its error, where that is given: 36 numbers by rows.
pub(super) fn read_noisy_pose<'de, A: MapAccess<'de>>(map: &mut A) -> Result<(Pose, Option<Matrix6<f64>>), A::Error> {
    let mut entries = PoseEntries::new(&["xyz", "quat", "rpy", "covariance"]);
    map.next_value_seed(Object(&mut entries))?;
    Ok((entries.pose(), entries.covariance))
}

struct PoseEntries {
    keys: Keys,
    xyz: [f64; 3],
    rotation: Option<Matrix3<f64>>,
    covariance: Option<Matrix6<f64>>,
}

impl PoseEntries {
    fn new(known: &'static [&'static str]) -> Self {
        PoseEntries { keys: Keys::new(known), xyz: [0.0; 3], rotation: None, covariance: None }
    }

    fn pose(&self) -> Pose {
        Pose { rotation: self.rotation.unwrap_or_else(Matrix3::identity), translation: Vector3::from(self.xyz) }
    }
}

/// Differences this large between the two halves are no rounding.
const ASYMMETRIC: f64 = 1e-6;

fn covariance(rows: [f64; 36]) -> Result<Option<Matrix6<f64>>, String> {
    let given = Matrix6::from_row_slice(&rows);
    if (given - given.transpose()).amax() > ASYMMETRIC * given.amax() {
        return Err(
            "a covariance is symmetric (36 numbers by rows: x, y, z, then the rotation about x, y, z)".to_owned()
        );
    }
    let symmetric = 0.5 * (given + given.transpose());
    match symmetric.cholesky() {
        Some(_) => Ok(Some(symmetric)),
        None => Err("a covariance is positive definite; one that is not known is left out".to_owned()),
    }
}

impl Entries for PoseEntries {
    type Key = &'static str;
    const WHAT: &'static str = "a pose {\"xyz\":[x,y,z],\"quat\":[x,y,z,w]}";

    fn key(&mut self, name: &str) -> Result<&'static str, String> {
        let key = self.keys.meet(name)?;
        if matches!(key, "quat" | "rpy") && self.rotation.is_some() {
            return Err("the rotation is given twice: `quat` or `rpy`, not both".to_owned());
        }
        Ok(key)
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, key: &'static str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "xyz" => self.xyz = map.next_value_seed(Numbers(Ok))?,
            "covariance" => self.covariance = map.next_value_seed(Numbers(covariance))?,
            "rpy" => self.rotation = map.next_value_seed(Numbers(|rpy| Ok(Some(orientation::from_rpy(rpy)))))?,
            _ => {
                self.rotation = map.next_value_seed(Numbers(|quat| {
                    let rotation = orientation::from_quaternion(quat);
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
