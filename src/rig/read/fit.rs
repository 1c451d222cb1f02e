//! The table `[fit]`: how a learned rig was learned.
use super::document::Node;
use super::estimate::{problem_of_pattern, read_by_path};
use crate::Error;
use crate::rig::{Fit, Rig};

pub(super) fn read_fit(node: &Node, rig: &Rig) -> Result<Fit, Error> {
    let known = ["samples", "observations", "rejected", "rms_px", "mean_px", "rms_points_m", "gauge", "joints", "sd"];
    let fields = node.clone().table(&known)?.labelled("fit");
    let count = |node: &Node| node.whole::<u32>().map(|n| n as usize);
    let sd = fields.optional("sd", |node| {
        read_by_path(node, |field, path| match problem_of_pattern(path, rig) {
            Some(problem) => Err(field.value.error(problem)),
            None => read_deviations(&field.value),
        })
    })?;
    Ok(Fit {
        samples: fields.optional("samples", count)?.unwrap_or_default(),
        observations: fields.optional("observations", count)?.unwrap_or_default(),
        rejected: fields.optional("rejected", count)?.unwrap_or_default(),
        rms_px: fields.optional("rms_px", Node::not_negative)?.unwrap_or_default(),
        mean_px: fields.optional("mean_px", Node::not_negative)?.unwrap_or_default(),
        rms_points_m: fields.optional("rms_points_m", Node::not_negative)?,
        gauge: fields.optional("gauge", read_gauge)?.unwrap_or_default(),
        joints: fields.optional("joints", |node| read_ranges(node, rig))?.unwrap_or_default(),
        sd: sd.unwrap_or_default(),
    })
}

/// One sentence or several.
fn read_gauge(node: &Node) -> Result<Vec<String>, Error> {
    if node.is_list() {
        node.list()?.iter().map(|entry| entry.text().map(str::to_owned)).collect()
    } else {
        Ok(vec![node.text()?.to_owned()])
    }
}

/// [smallest, largest] of every joint.
fn read_ranges(node: &Node, rig: &Rig) -> Result<Vec<[f64; 2]>, Error> {
    let ranges = node.list()?.iter().map(Node::numbers::<2>).collect::<Result<Vec<_>, _>>()?;
    if ranges.len() != rig.robot.joints.len() {
        let (found, joints) = (ranges.len(), rig.robot.joints.len());
        return Err(node.error(format!("expected a range for each of {joints} joints, found {found}")));
    }
    match ranges.iter().find(|[lower, upper]| lower > upper) {
        Some([lower, upper]) => Err(node.error(format!("a range begins at {lower} and ends below it, at {upper}"))),
        None => Ok(ranges),
    }
}

/// One number, or one for every number of the parameter.
fn read_deviations(node: &Node) -> Result<Vec<f64>, Error> {
    if node.is_list() { node.list()?.iter().map(Node::not_negative).collect() } else { Ok(vec![node.not_negative()?]) }
}
