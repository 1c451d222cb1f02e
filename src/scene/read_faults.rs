//! Reading which trackers of a scene fail.
use crate::Error;
use crate::rig::Rig;
use crate::rig::read::document::{Fields, Node};
use crate::simulate::world::{Fault, FaultKind};

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
