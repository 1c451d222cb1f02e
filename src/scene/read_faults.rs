//! Reading which trackers of a scene fail, and which of its joints slip or are dragged along.
use super::{NamedCoupling, NamedFault, NamedSlip};
use crate::Error;
use crate::rig::read::document::{Fields, Node};
use crate::simulate::world::FaultKind;

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
