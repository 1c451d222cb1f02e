//! Reading which controller a scene has.
use super::{Control, UncalibratedControl};
use crate::Error;
use crate::rig::read::document::{Fields, Node};
use crate::servo::uncalibrated::Settings;
use crate::servo::{Gain, ImageSettings, InteractionMatrix, PoseSettings};

/// The words for controllers.
const KINDS: &[&str] = &["model-based", "model-based-tip", "image-based", "pose-based", "uncalibrated", "hybrid"];

/// The table `controller` of a scene with or without a task.
pub(super) fn read_control(node: Node, has_task: bool) -> Result<Control, Error> {
    let fields =
        node.table(&["kind", "speed", "matrix", "gain", "infer_joints", "pixels", "dead_band"])?.labelled("controller");
    let kind = fields.optional("kind", |node| node.word("controller", KINDS, |name| name))?.unwrap_or(if has_task {
        "uncalibrated"
    } else {
        KINDS[0]
    });
    let is_visual = kind == "image-based" || kind == "pose-based";
    if kind != "model-based-tip" && fields.field("speed").is_some() {
        return Err(fields.error("`speed` ([m/s, rad/s]) is for model-based-tip; others take [limits]"));
    }
    if has_task && kind != "uncalibrated" {
        return Err(fields.error(format!("a task is carried out by `kind = \"uncalibrated\"`, this is {kind}")));
    }
    if let (true, Some(field)) = (has_task, fields.field("pixels")) {
        return Err(field.value.error("is `noise = { pixels = ... }` of the task, in a scene that has one"));
    }
    if kind == "uncalibrated" || kind == "hybrid" {
        return read_uncalibrated(&fields, kind == "hybrid").map(Control::Uncalibrated);
    }
    for (key, what) in [("pixels", "noise of the trackers"), ("dead_band", "of the robot's joints")] {
        if fields.field(key).is_some() {
            return Err(fields.error(format!("`{key}` ({what}) is for uncalibrated and hybrid, this is {kind}")));
        }
    }
    if let Some(key) = ["matrix", "gain", "infer_joints"].iter().find(|key| !is_visual && fields.field(key).is_some()) {
        return Err(fields.error(format!("`{key}` is for image-based and pose-based, this is {kind}")));
    }
    let name = InteractionMatrix::name;
    let matrix = fields.optional("matrix", |node| node.word("interaction matrix", InteractionMatrix::ALL, name))?;
    let matrix = matrix.unwrap_or_default();
    let gain = fields.optional("gain", read_gain)?.unwrap_or_default();
    let infer_joints = fields.optional("infer_joints", Node::flag)?.unwrap_or(false);
    Ok(match kind {
        "image-based" => Control::ImageBased(ImageSettings { matrix, gain, infer_joints, ..ImageSettings::default() }),
        "pose-based" => Control::PoseBased(PoseSettings { matrix, gain, infer_joints, ..PoseSettings::default() }),
        "model-based-tip" => {
            let speed = fields.optional("speed", |node| match node.numbers::<2>()? {
                speed if speed.iter().all(|speed| *speed > 0.0) => Ok(speed),
                _ => Err(node.error("must be two numbers above 0: m/s and rad/s")),
            })?;
            Control::ModelBasedTip { speed: speed.unwrap_or([f64::INFINITY; 2]) }
        }
        _ => Control::ModelBased,
    })
}

fn read_uncalibrated(fields: &Fields<'_>, hybrid: bool) -> Result<UncalibratedControl, Error> {
    if let Some(key) = ["matrix", "infer_joints"].iter().find(|key| fields.field(key).is_some()) {
        return Err(fields.error(format!("`{key}` is for image-based and pose-based")));
    }
    let default = UncalibratedControl::default();
    let settings = if hybrid { Settings::with_rig() } else { Settings::default() };
    let gain = fields.optional("gain", read_share)?.unwrap_or(settings.gain);
    Ok(UncalibratedControl {
        pixels: fields.optional("pixels", Node::positive)?.unwrap_or(default.pixels),
        settings: Settings { gain, ..settings },
        dead_band: fields.optional("dead_band", Node::not_negative)?.unwrap_or(default.dead_band),
        hybrid,
    })
}

/// A number, or `{ near, far, slope }`.
fn read_gain(node: &Node) -> Result<Gain, Error> {
    if !node.is_table() {
        return read_share(node).map(Gain::Constant);
    }
    let fields = node.clone().table(&["near", "far", "slope"])?;
    let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}`")));
    Ok(Gain::Adaptive {
        near: read_share(&need("near")?.value)?,
        far: read_share(&need("far")?.value)?,
        slope: need("slope")?.value.not_negative()?,
    })
}

/// Above 0, and at most 1.
fn read_share(node: &Node) -> Result<f64, Error> {
    let share = node.positive()?;
    if share > 1.0 {
        return Err(node.error(format!("must be at most 1, found {share}")));
    }
    Ok(share)
}
