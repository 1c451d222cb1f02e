//! Reading which trackers of a scene fail, and which of its joints slip or are dragged along.
use crate::Error;
use crate::rig::Rig;
use crate::rig::read::document::{Fields, Node};
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

/// The list `couplings` of the table `robot`.
pub(super) fn read_couplings(fields: &Fields) -> Result<Vec<NamedCoupling>, Error> {
    let read = |entry: Node| {
        let fields = entry.table(&["joint", "by", "share"])?.labelled("couplings");
        let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}`")));
        Ok(NamedCoupling {
            joint: need("joint")?.value.text()?.to_owned(),
            by: need("by")?.value.text()?.to_owned(),
            share: need("share")?.value.number()?,
        })
    };
    fields.optional("couplings", Node::list)?.unwrap_or_default().into_iter().map(read).collect()
}

/// The list `slips` of the table `robot`.
pub(super) fn read_slips(fields: &Fields) -> Result<Vec<NamedSlip>, Error> {
    fields.optional("slips", Node::list)?.unwrap_or_default().into_iter().map(read_slip).collect()
}

fn read_slip(entry: Node) -> Result<NamedSlip, Error> {
    let fields = entry.table(&["joint", "by", "at"])?.labelled("slips");
    let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}`")));
    Ok(NamedSlip {
        joint: need("joint")?.value.text()?.to_owned(),
        by: need("by")?.value.number()?,
        at: fields.optional("at", Node::not_negative)?.unwrap_or(0.0),
    })
}

/// The list `faults` of the table `tracker`.
pub(super) fn read_faults(fields: &Fields) -> Result<Vec<NamedFault>, Error> {
    fields.optional("faults", Node::list)?.unwrap_or_default().into_iter().map(read_fault).collect()
}

fn read_fault(entry: Node) -> Result<NamedFault, Error> {
    let fields = entry.table(&["camera", "feature", "kind", "by", "from", "until"])?.labelled("faults");
    let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}`")));
    let kind = need("kind")?.value.word("fault", &["lost", "frozen", "jump", "drift"], |name| name)?;
    let by = fields.optional("by", Node::numbers::<2>)?;
    let kind = match (kind, by) {
        ("jump", Some(by)) => FaultKind::Jumped(by),
        ("drift", Some(by)) => FaultKind::Drifting(by),
        ("jump" | "drift", None) => return Err(fields.error("has no `by` ([u, v]: px of a jump, px/s of a drift)")),
        (_, Some(_)) => return Err(fields.error(format!("is {kind}, and `by` is for jump and drift"))),
        ("lost", None) => FaultKind::Lost,
        _ => FaultKind::Frozen,
    };
    let from = fields.optional("from", Node::not_negative)?.unwrap_or(0.0);
    let until = fields.optional("until", Node::not_negative)?.unwrap_or(f64::INFINITY);
    if until <= from {
        return Err(fields.error(format!("ends at {until} s, before it begins at {from} s")));
    }
    Ok(NamedFault {
        camera: need("camera")?.value.text()?.to_owned(),
        feature: need("feature")?.value.text()?.to_owned(),
        kind,
        span: [from, until],
    })
}
