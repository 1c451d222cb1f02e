//! What fails in a scene, by the names of its world's rig.
use crate::Error;
use crate::rig::Rig;
use crate::simulate::world::{Coupling, Fault, FaultKind, Slip};

/// A tracker that fails, by the names of the world's rig.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedFault {
    /// Name of the camera.
    pub camera: String,
    /// Name of the feature.
    pub feature: String,
    /// What goes wrong.
    pub kind: FaultKind,
    /// From when to when [s].
    pub span: [f64; 2],
}

impl NamedFault {
    /// The same by the rig's indices.
    ///
    /// Errors: [`Error::Unusable`] where the rig has no such camera or feature.
    pub(super) fn of(&self, rig: &Rig) -> Result<Fault, Error> {
        let camera = rig.cameras.iter().position(|camera| camera.name == self.camera);
        let feature = rig.features.iter().position(|feature| feature.name == self.feature);
        let (Some(camera), Some(feature)) = (camera, feature) else {
            let (what, name) = if camera.is_none() { ("camera", &self.camera) } else { ("feature", &self.feature) };
            return Err(Error::Unusable(format!(
                "a fault of the scene's trackers is of {what} `{name}`, which its rig has not"
            )));
        };
        let [from, until] = self.span;
        Ok(Fault { camera, feature, kind: self.kind, from, until })
    }
}

/// A joint that slips, by its name in the world's rig.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSlip {
    /// Name of the joint.
    pub joint: String,
    /// How far its link jumps [rad or m].
    pub by: f64,
    /// When [s].
    pub at: f64,
}

impl NamedSlip {
    /// The same by the rig's index.
    ///
    /// Errors: [`Error::Unusable`] where the rig has no such joint.
    pub(super) fn of(&self, rig: &Rig) -> Result<Slip, Error> {
        let joint = joint_of(rig, "slips", &self.joint)?;
        Ok(Slip { joint, by: self.by, at: self.at })
    }
}

/// A joint that another drags along, by their names in the world's rig.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCoupling {
    /// Name of the joint that is dragged along.
    pub joint: String,
    /// Name of the joint that does so.
    pub by: String,
    /// Motion of the one over that of the other.
    pub share: f64,
}

impl NamedCoupling {
    /// The same by the rig's indices.
    ///
    /// Errors: [`Error::Unusable`] where the rig has no such joint.
    pub(super) fn of(&self, rig: &Rig) -> Result<Coupling, Error> {
        let find = |name: &String| joint_of(rig, "couplings", name);
        Ok(Coupling { joint: find(&self.joint)?, by: find(&self.by)?, share: self.share })
    }
}

fn joint_of(rig: &Rig, key: &str, name: &String) -> Result<usize, Error> {
    let found = rig.robot.joints.iter().position(|joint| joint.name == *name);
    found.ok_or_else(|| {
        Error::Unusable(format!("`{key}` of the scene's robot names joint `{name}`, which its rig has not"))
    })
}
