//! The page of a servo run.
use super::arm::{Shown, thinned, view};
use super::charts::{Curve, curve, ways};
use super::page::{About, Page};
use crate::Error;
use crate::chain::JointKind;
use crate::recording::{Recording, Sample};
use crate::rig::Rig;
use crate::scene::{Moment, Run};
use crate::servo::Stop;
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Rows of the table of steps at most.
const ROWS: usize = 24;

/// The page of a run in simulation, with the loop as an animation. `rig`: that of the world, by which the arm is drawn; `has_rig`: whether the
/// controller knew one.
///
/// Errors: [`Error::Unusable`] where the rig is not complete.
pub fn servo_html(about: &About<'_>, rig: &Rig, has_rig: bool, run: &Run) -> Result<String, Error> {
    let mut page = Page::new(about);
    summary(&mut page, rig, run);
    let stride = thinned(run.moments.len());
    images(&mut page, run, stride);
    let joints = |moment: &Moment| Sample { joints: Some(moment.joints.clone()), ..Sample::default() };
    let samples = run.moments.iter().map(joints).collect();
    let features: Vec<&[Vector3<f64>]> = run.moments.iter().map(|moment| &moment.features[..]).collect();
    view(&mut page, rig, &Recording { samples, ..run.header.clone() }, Shown::Each(&features))?;
    errors(&mut page, run);
    joint_curves(&mut page, rig, run);
    held_back(&mut page, rig, run);
    steps(&mut page, run);
    next(&mut page, run, has_rig);
    Ok(page.finish())
}

fn summary(page: &mut Page, rig: &Rig, run: &Run) {
    page.section("summary", "How it ended");
    let last = run.moments.last();
    let px = last.and_then(|moment| moment.error_px).map(|px| (format!("{px:.3} px"), "error in pixels at the end"));
    let space =
        last.map(|moment| (format!("{:.3} mm", 1e3 * moment.error_m), "distance in space at the end, in truth"));
    let seconds = last.map(|moment| (format!("{:.2} s", moment.time), "until it stopped"));
    let stop = (run.stop.name().to_owned(), "why it stopped");
    let commands = (run.commands.to_string(), "commands");
    page.figures(&[Some(stop), px, space, Some(commands), seconds].into_iter().flatten().collect::<Vec<_>>());
    page.paragraph(&format!("{}.", run.stop.words(rig, &run.limits)));
}

/// What every camera saw, moment by moment.
fn images(page: &mut Page, run: &Run, stride: usize) {
    page.section("images", "What the cameras saw");
    let (cameras, n_features) = (&run.header.cameras, run.header.features.len());
    let drawing = |(index, camera): (usize, &crate::recording::RecordedCamera)| {
        let size = camera.size.unwrap_or([640, 480]).map(f64::from);
        let svg = ways(&run.moments, index as u32, n_features as u32, size);
        (
            svg,
            format!(
                "{}: the ways of the features, where they are (filled), and where they shall be (crosses)",
                camera.name
            ),
        )
    };
    let drawings: Vec<(String, String)> = cameras.iter().enumerate().map(drawing).collect();
    let shown: Vec<(usize, &Moment)> = run.moments.iter().enumerate().step_by(stride).collect();
    let data: Vec<Value> =
        shown.iter().map(|(step, moment)| of_moment(*step, moment, cameras.len(), n_features)).collect();
    page.player(shown.len(), &drawings, &Value::from(data).to_string());
}

/// What the script shows of a moment: its words, and by camera and feature where it is seen, to a tenth of a pixel.
fn of_moment(step: usize, moment: &Moment, n_cameras: usize, n_features: usize) -> Value {
    let mut pixels = vec![vec![Value::Null; n_features]; n_cameras];
    for seen in &moment.pixels {
        let place = seen.pixel.map(|number| (number * 10.0).round() / 10.0);
        pixels[seen.camera as usize][seen.feature as usize] = json!(place);
    }
    let px = moment.error_px.map_or("nothing seen".to_owned(), |px| format!("{px:.3} px"));
    let state = match (&moment.waits, moment.active.len()) {
        (Some(why), _) => format!(", waits: {why}"),
        (None, 0) => String::new(),
        (None, held) => format!(", held back by {held}"),
    };
    json!({ "words": format!("step {step}, {:.2} s: {px}, {:.2} mm{state}", moment.time, 1e3 * moment.error_m), "pixels": pixels })
}

fn errors(page: &mut Page, run: &Run) {
    let pixels: Vec<(f64, f64)> =
        run.moments.iter().map(|moment| (moment.time, moment.error_px.unwrap_or(f64::NAN))).collect();
    let space: Vec<(f64, f64)> = run.moments.iter().map(|moment| (moment.time, 1e3 * moment.error_m)).collect();
    page.section("errors", "How the error fell");
    page.begin_row();
    let both = [("error [px]", &pixels), ("distance in space, in truth [mm]", &space)];
    for (words, values) in both {
        let drawing = curve(&Curve { words, values, is_logarithmic: true, bounds: &[] });
        page.drawing(&drawing, &format!("{words} against time"));
    }
    page.end_row();
}

/// Every joint against time, with its limits where it comes near them.
fn joint_curves(page: &mut Page, rig: &Rig, run: &Run) {
    if rig.robot.joints.is_empty() {
        return;
    }
    page.section("joints", "How the joints moved");
    page.begin_row();
    for (index, joint) in rig.robot.joints.iter().enumerate() {
        let values: Vec<(f64, f64)> = run.moments.iter().map(|moment| (moment.time, moment.joints[index])).collect();
        let of = |pick: fn(f64, f64) -> f64, from: f64| values.iter().map(|(_, value)| *value).fold(from, pick);
        let (least, most) = (of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY));
        let near = (most - least).max(0.05);
        let bounds: Vec<f64> = [joint.limits.lower, joint.limits.upper]
            .into_iter()
            .flatten()
            .filter(|bound| (least - near..=most + near).contains(bound))
            .collect();
        let unit = if joint.kind == JointKind::Revolute { "rad" } else { "m" };
        let words = format!("{} [{unit}]", joint.name);
        let drawing = curve(&Curve { words: &words, values: &values, is_logarithmic: false, bounds: &bounds });
        page.drawing(
            &drawing,
            &format!("{words} against time{}", if bounds.is_empty() { "" } else { ", with its limits" }),
        );
    }
    page.end_row();
}

/// What held the motion back or made the loop wait, and when.
fn held_back(page: &mut Page, rig: &Rig, run: &Run) {
    /// How often, and from when to when [s].
    struct Times(usize, f64, f64);
    let mut reasons: BTreeMap<String, Times> = BTreeMap::new();
    for moment in &run.moments {
        let held = moment.active.iter().map(|active| active.constraint.words(rig, &run.limits));
        let conflict = moment.conflict.iter().map(|constraint| {
            format!("{}, which cannot hold together with others", constraint.words(rig, &run.limits))
        });
        let waits = moment.waits.iter().map(|why| format!("it waits: {why}"));
        let mut of_moment: Vec<String> = held.chain(conflict).chain(waits).collect();
        of_moment.sort();
        of_moment.dedup();
        for reason in of_moment {
            let times = reasons.entry(reason).or_insert(Times(0, moment.time, moment.time));
            (times.0, times.2) = (times.0 + 1, moment.time);
        }
    }
    page.section("held", "What held it back");
    if reasons.is_empty() {
        return page.paragraph("Nothing did.");
    }
    let row = |(reason, Times(count, from, to)): (String, Times)| {
        vec![reason, count.to_string(), format!("{from:.2}"), format!("{to:.2}")]
    };
    let rows: Vec<Vec<String>> = reasons.into_iter().map(row).collect();
    page.table(&["", "steps", "from s", "to s"], rows.iter().map(Vec::as_slice));
}

fn steps(page: &mut Page, run: &Run) {
    let count = run.moments.len();
    let stride = count.div_ceil(ROWS).max(1);
    let row = |(index, moment): (usize, &Moment)| {
        let px = moment.error_px.map_or("-".to_owned(), |px| format!("{px:.3}"));
        vec![index.to_string(), format!("{:.2}", moment.time), px, format!("{:.3}", 1e3 * moment.error_m)]
    };
    let shown = run.moments.iter().enumerate().filter(|(index, _)| index % stride == 0 || index + 1 == count);
    let rows: Vec<Vec<String>> = shown.map(row).collect();
    page.section("steps", "Step by step");
    page.table(&["step", "time s", "px", "mm"], rows.iter().map(Vec::as_slice));
}

/// What a reader may do.
fn next(page: &mut Page, run: &Run, has_rig: bool) {
    let words = match &run.stop {
        Stop::Converged { .. } => "It arrived: nothing needs to be done.".to_owned(),
        Stop::NoBetter { .. } => {
            let who = if has_rig { "the rig is off (`handeye evaluate` tells by how much), or " } else { "" };
            format!(
                "Where the error left is of the size by which it varies, only less noise brings it nearer. Where it is much larger, what is \
                 aimed at cannot be reached exactly: {who}a tracker or the target is off."
            )
        }
        Stop::Blocked { .. } => "Loosen the limits that are named, or begin or end elsewhere.".to_owned(),
        Stop::Diverged { .. } if has_rig => {
            "The controller is wrong about how the pixels move: `handeye evaluate` and `handeye monitor` tell whether the rig still describes \
             this robot; a smaller gain helps where it is only roughly right."
                .to_owned()
        }
        Stop::Diverged { .. } => {
            "What was explored does not hold on the way: a smaller gain, a start nearer to the target or cameras at a wider angle help.".to_owned()
        }
        Stop::Undetermined { .. } => "More features, or a camera that sees them from elsewhere, determine the motion.".to_owned(),
        Stop::Lost { why, .. } => {
            let limit = if has_rig { ", or the limit in_image where they leave the images" } else { "" };
            format!("Mend what was missing at last ({why}); a start nearer to the target{limit} may keep features in view.")
        }
        Stop::TimedOut { .. } => "Give the loop more time or the arm more speed, where the error was still falling.".to_owned(),
    };
    page.section("next", "What to do next");
    page.paragraph(&words);
}
