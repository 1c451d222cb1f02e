//! Sections that several pages share: how well a rig predicts a recording.
use super::charts::{Strip, arrows_of, map, scatter, strips};
use super::noise::in_use;
use super::page::{About, Page};
use super::residuals::Residual;
use crate::calibrate::{CameraErrors, Finding, median};
use crate::chain::JointKind;
use crate::doctor;
use crate::recording::Recording;
use crate::rig::Rig;

/// Worst samples that are listed, and whose images are drawn.
pub(super) const WORST: usize = 10;
const DRAWN: usize = 4;

/// What there is to say of how a recording was read, and of samples that repeat; nothing where there is nothing.
pub(super) fn how_it_was_read(page: &mut Page, about: &About<'_>, recording: &Recording) {
    let repeats = doctor::repeats(recording).map(|doctor::Finding { what, change, .. }| format!("{what}: {change}"));
    let lines: Vec<String> = about.notes.iter().cloned().chain(repeats).collect();
    if !lines.is_empty() {
        page.section("reading", "How the recording was read");
        page.list(&lines);
    }
}

/// A sample's index, and its time where samples have times.
pub(super) fn sample_cells(recording: &Recording, sample: usize) -> Vec<String> {
    let time = recording.samples.get(sample).and_then(|sample| sample.time);
    let time = time.map_or_else(|| "-".to_owned(), |time| format!("{time:.3}"));
    [sample.to_string()].into_iter().chain(has_times(recording).then_some(time)).collect()
}

/// What stands above them.
pub(super) fn sample_header(recording: &Recording) -> Vec<&'static str> {
    ["sample (from 0)"].into_iter().chain(has_times(recording).then_some("time s")).collect()
}

fn has_times(recording: &Recording) -> bool {
    recording.samples.iter().any(|sample| sample.time.is_some())
}

/// Scatter and map of every camera's residuals.
pub(super) fn cameras(page: &mut Page, rig: &Rig, cameras: &[CameraErrors], residuals: &[Residual]) {
    if cameras.is_empty() {
        return;
    }
    page.section("cameras", "Cameras");
    let has_points = cameras.iter().any(|camera| camera.errors.points.observations > 0);
    let row = |CameraErrors { name, errors, rejected }: &CameraErrors| {
        let px = [errors.rms_px, errors.mean_px, errors.median_px, errors.max_px].map(|px| format!("{px:.3}"));
        let counts = [name.clone(), errors.observations.to_string(), rejected.to_string()];
        let points = [errors.points.observations.to_string(), format!("{:.3}", 1e3 * errors.points.rms_m)];
        counts.into_iter().chain(px).chain(points.into_iter().filter(|_| has_points)).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = cameras.iter().map(row).collect();
    let mut header = vec!["camera", "detections", "left out", "rms px", "mean px", "median px", "largest px"];
    header.extend(["points", "rms mm"].into_iter().filter(|_| has_points));
    page.table(&header, rows.iter().map(Vec::as_slice));
    let sds = scales(rig, residuals);
    for (index, camera) in rig.cameras.iter().enumerate() {
        let sd = sds[index];
        let own: Vec<&Residual> = residuals.iter().filter(|residual| residual.camera == index).collect();
        if own.is_empty() {
            continue;
        }
        let size = camera.size.map(|size| size.map(f64::from)).unwrap_or_else(|| extent(&own));
        page.begin_row();
        page.drawing(
            &scatter(&own, sd),
            &format!("{}: residuals [px], with circles at 1, 2 and 3 standard deviations", camera.name),
        );
        let exaggeration = 0.04 * size[0] / sd;
        let exaggeration = if exaggeration >= 1.0 { exaggeration.round() } else { 1.0 };
        let clear: Vec<&Residual> = own.iter().copied().filter(|residual| residual.distance() < 12.0 * sd).collect();
        let shown = match arrows_of(clear.len()) {
            1 => "the residuals".to_owned(),
            every => format!("one residual in {every}"),
        };
        page.drawing(
            &map(&clear, size, exaggeration),
            &format!("{}: where the image was covered, and {shown}, {exaggeration} times as long", camera.name),
        );
        page.end_row();
    }
}

/// Standard deviation of a coordinate in every camera of a rig, from the median distance of Gaussian residuals [px].
pub(super) fn scales(rig: &Rig, residuals: &[Residual]) -> Vec<f64> {
    let of = |camera: usize| {
        let own = residuals.iter().filter(|residual| residual.camera == camera);
        (median(&mut own.map(Residual::distance).collect::<Vec<_>>()) / (2.0 * std::f64::consts::LN_2).sqrt()).max(1e-6)
    };
    (0..rig.cameras.len()).map(of).collect()
}

/// As large as what was seen.
fn extent(residuals: &[&Residual]) -> [f64; 2] {
    let most = |axis: usize| residuals.iter().map(|residual| residual.seen[axis]).fold(1.0, f64::max);
    [most(0), most(1)]
}

/// The samples that are worst as a whole, with their images: a single wrong detection does not make one.
pub(super) fn worst(page: &mut Page, rig: &Rig, recording: &Recording, residuals: &[Residual], findings: &[Finding]) {
    let used = in_use(rig, residuals, findings);
    let mut samples: Vec<(&[&Residual], f64)> = Vec::new();
    for of_sample in used.chunk_by(|a, b| a.sample == b.sample) {
        samples.push((of_sample, median(&mut of_sample.iter().map(|one| one.distance()).collect::<Vec<_>>())));
    }
    samples.sort_by(|a, b| b.1.total_cmp(&a.1));
    samples.truncate(WORST);
    if samples.is_empty() {
        return;
    }
    page.section("worst", "The samples that fit worst");
    if used.len() < residuals.len() {
        page.paragraph("Of the detections that are not named as not fitting.");
    }
    let sds = scales(rig, residuals);
    let row = |(of_sample, median_px): &(&[&Residual], f64)| {
        let n_far = of_sample.iter().filter(|residual| residual.distance() > 6.0 * sds[residual.camera]).count();
        let cells = [format!("{median_px:.3}"), of_sample.len().to_string(), n_far.to_string()];
        sample_cells(recording, of_sample[0].sample).into_iter().chain(cells).collect()
    };
    let rows: Vec<Vec<String>> = samples.iter().map(row).collect();
    let figures = ["median px", "detections", "beyond six standard deviations"];
    let header = [&sample_header(recording)[..], &figures].concat();
    page.table(&header, rows.iter().map(Vec::as_slice));
    page.begin_row();
    for (of_sample, median_px) in samples.iter().take(DRAWN) {
        for (index, camera) in rig.cameras.iter().enumerate() {
            let own: Vec<&Residual> = of_sample.iter().copied().filter(|residual| residual.camera == index).collect();
            if own.is_empty() {
                continue;
            }
            let size = camera.size.map(|size| size.map(f64::from)).unwrap_or_else(|| extent(&own));
            let longer = (0.04 * size[0] / median_px.max(1e-9)).round().max(1.0);
            let caption = format!("sample {}, {}: {longer} times as long", of_sample[0].sample, camera.name);
            page.drawing(&map(&own, size, longer), &caption);
        }
    }
    page.end_row();
}

/// Where the joints have been.
pub(super) fn coverage(page: &mut Page, rig: &Rig, recording: &Recording) {
    let strip = |(index, joint): (usize, &crate::rig::Joint)| {
        let samples = recording.samples.iter();
        let values: Vec<f64> = samples.filter_map(|sample| sample.joints.as_ref()?.get(index).copied()).collect();
        let [least, most] = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
        let unit = if joint.kind == JointKind::Revolute { "rad" } else { "m" };
        let range = [joint.limits.lower.unwrap_or(least).min(least), joint.limits.upper.unwrap_or(most).max(most)];
        (!values.is_empty()).then(|| Strip { name: format!("{} [{unit}]", joint.name), range, values })
    };
    let all: Vec<Strip> = rig.robot.joints.iter().enumerate().filter_map(strip).collect();
    if !all.is_empty() {
        page.section("coverage", "Where the joints have been");
        page.drawing(
            &strips(&all),
            "every sample, between the limits where the rig has them, else between the extremes",
        );
    }
}
