//! The sections of the page, each from what the calibration says of itself.
use super::charts::{Strip, histogram, map, scatter, strips};
use super::page::Page;
use super::residuals::Residual;
use super::{ExtraTable, Subject};
use crate::calibrate::{CameraErrors, DeterminedBy, Finding, median};
use crate::chain::JointKind;
use crate::rig::Rig;

/// Worst samples that are listed, and whose images are drawn.
const WORST: usize = 10;
const DRAWN: usize = 4;

/// How good it is, in a few figures, and what is wrong.
pub(super) fn summary(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    page.section("summary", "How good it is");
    let mut figures = Vec::new();
    if report.observations > report.points.observations {
        figures.push((format!("{:.3} px", report.rms_px), "root mean square of the pixel distances"));
        figures.push((format!("{:.3} px", report.median_px), "median pixel distance"));
    }
    if report.points.observations > 0 {
        let figure = format!("{:.3} mm", 1e3 * report.points.rms_m);
        figures.push((figure, "root mean square of the distances of depth cameras' points"));
    }
    if let Some(tip) = report.tip {
        let figure = if tip.metric { format!("{:.3} mm", 1e3 * tip.median) } else { format!("{:.1e}", tip.median) };
        figures.push((
            figure,
            if tip.metric {
                "standard deviation of the tip's position"
            } else {
                "standard deviation of the tip's position, in the model's unit: nothing metric is known"
            },
        ));
    }
    figures.extend([
        (report.samples.to_string(), "samples"),
        (report.observations.to_string(), "detections used"),
        (report.rejected.to_string(), "detections left out"),
    ]);
    page.figures(&figures);
    if !report.converged {
        page.paragraph("No minimum was reached: what stands below is not to be relied on.");
    }
    page.list(&report.states);
    if report.findings.is_empty() {
        page.paragraph("Nothing in the recording stands out as wrong.");
    } else {
        page.paragraph("What does not fit:");
        page.list(&report.findings.iter().map(Finding::to_string).collect::<Vec<_>>());
    }
}

/// Scatter and map of every camera's residuals.
pub(super) fn cameras(page: &mut Page, subject: &Subject<'_>, residuals: &[Residual]) {
    let (rig, report) = (&subject.calibration.rig, &subject.calibration.report);
    page.section("cameras", "Cameras");
    let has_points = report.points.observations > 0;
    let row = |CameraErrors { name, errors, rejected }: &CameraErrors| {
        let px = [errors.rms_px, errors.mean_px, errors.median_px, errors.max_px].map(|px| format!("{px:.3}"));
        let counts = [name.clone(), errors.observations.to_string(), rejected.to_string()];
        let points = [errors.points.observations.to_string(), format!("{:.3}", 1e3 * errors.points.rms_m)];
        counts.into_iter().chain(px).chain(points.into_iter().filter(|_| has_points)).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = report.cameras.iter().map(row).collect();
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
            &format!("{}: residuals, with circles at 1, 2 and 3 standard deviations", camera.name),
        );
        let exaggeration = 0.04 * size[0] / sd;
        let exaggeration = if exaggeration >= 1.0 { exaggeration.round() } else { 1.0 };
        let clear: Vec<&Residual> = own.iter().copied().filter(|residual| residual.distance() < 12.0 * sd).collect();
        page.drawing(
            &map(&clear, size, exaggeration),
            &format!("{}: where the image was covered, and residuals {exaggeration} times as long", camera.name),
        );
        page.end_row();
    }
}

/// Standard deviation of a coordinate in every camera of a rig, from the median distance of Gaussian residuals [px].
fn scales(rig: &Rig, residuals: &[Residual]) -> Vec<f64> {
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

/// The distances beside what Gaussian noise of their own size gives.
pub(super) fn histogram_of(page: &mut Page, subject: &Subject<'_>, residuals: &[Residual]) {
    if residuals.is_empty() {
        return;
    }
    let sds = scales(&subject.calibration.rig, residuals);
    let over_sd = |residual: &Residual| residual.error.map(|error| error / sds[residual.camera]);
    let coordinates: Vec<f64> = residuals.iter().flat_map(over_sd).collect();
    let gaussian = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    page.section("histogram", "Are the errors noise?");
    page.drawing(
        &histogram(&coordinates, [-5.0, 5.0], 50, Some(&gaussian)),
        "residual coordinates over the standard deviation of their camera, and the curve that noise alone would give; what lies beyond 5 is counted at the ends",
    );
}

/// The samples that are worst as a whole, with their images: a single wrong detection does not make one.
pub(super) fn worst(page: &mut Page, subject: &Subject<'_>, residuals: &[Residual]) {
    let mut samples: Vec<(&[Residual], f64)> = Vec::new();
    for of_sample in residuals.chunk_by(|a, b| a.sample == b.sample) {
        samples.push((of_sample, median(&mut of_sample.iter().map(Residual::distance).collect::<Vec<_>>())));
    }
    samples.sort_by(|a, b| b.1.total_cmp(&a.1));
    samples.truncate(WORST);
    if samples.is_empty() {
        return;
    }
    page.section("worst", "The samples that fit worst");
    let sds = scales(&subject.calibration.rig, residuals);
    let row = |(of_sample, median_px): &(&[Residual], f64)| {
        let n_far = of_sample.iter().filter(|residual| residual.distance() > 6.0 * sds[residual.camera]).count();
        vec![of_sample[0].sample.to_string(), format!("{median_px:.3}"), of_sample.len().to_string(), n_far.to_string()]
    };
    let rows: Vec<Vec<String>> = samples.iter().map(row).collect();
    let header = ["sample (from 0)", "median px", "detections", "beyond six standard deviations"];
    page.table(&header, rows.iter().map(Vec::as_slice));
    page.begin_row();
    let rig = &subject.calibration.rig;
    for (of_sample, median_px) in samples.iter().take(DRAWN) {
        for (index, camera) in rig.cameras.iter().enumerate() {
            let own: Vec<&Residual> = of_sample.iter().filter(|residual| residual.camera == index).collect();
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
pub(super) fn coverage(page: &mut Page, subject: &Subject<'_>) {
    let rig = &subject.calibration.rig;
    let strip = |(index, joint): (usize, &crate::rig::Joint)| {
        let samples = subject.recording.samples.iter();
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

/// What the data leave open.
pub(super) fn open(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    page.section("open", "What the recording cannot tell");
    if report.gauge.is_empty() && report.weak.is_empty() {
        page.paragraph("Nothing: everything that was to be learned is determined by the recording.");
        return;
    }
    page.list(&report.gauge);
    let metric = report.tip.is_some_and(|tip| tip.metric);
    let row = |combination: &crate::calibrate::Combination| {
        let numbers = combination.numbers.iter().map(|(path, share)| format!("{share:+.2} {path}"));
        let by = match combination.determined_by {
            DeterminedBy::Nothing => "nothing".to_owned(),
            DeterminedBy::Prior(ratio) if ratio.is_finite() => format!("its prior, {ratio:.0} times the data"),
            DeterminedBy::Prior(_) => "its prior alone".to_owned(),
            DeterminedBy::Poorly { .. } => "the data, poorly".to_owned(),
        };
        let tip = combination.tip.map_or("unbounded".to_owned(), |tip| {
            if metric { format!("{:.3} mm", 1e3 * tip) } else { format!("{tip:.1e}") }
        });
        vec![numbers.collect::<Vec<_>>().join(", "), by, tip, combination.cure.clone()]
    };
    let rows: Vec<Vec<String>> = report.weak.iter().map(row).collect();
    if !rows.is_empty() {
        page.table(&["together", "determined by", "at the tip", "what would help"], rows.iter().map(Vec::as_slice));
    }
}

/// The samples on which the result hangs.
pub(super) fn influence(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    let mut most: Vec<_> = report.influence.iter().filter_map(|one| Some((one.sample, one.tip?, one.rms_px))).collect();
    if most.is_empty() {
        return;
    }
    most.sort_by(|a, b| b.1.total_cmp(&a.1));
    most.truncate(WORST);
    let metric = report.tip.is_some_and(|tip| tip.metric);
    page.section("influence", "The samples that matter most");
    page.paragraph("How far the tip would move without each of them.");
    let row = |(sample, tip, rms): &(usize, f64, f64)| {
        let moved = if metric { format!("{:.4} mm", 1e3 * tip) } else { format!("{tip:.1e}") };
        vec![sample.to_string(), moved, format!("{rms:.3}")]
    };
    let rows: Vec<Vec<String>> = most.iter().map(row).collect();
    page.table(&["sample (from 0)", "tip moves by", "its rms px"], rows.iter().map(Vec::as_slice));
}

/// Tables that were given along.
pub(super) fn extra(page: &mut Page, subject: &Subject<'_>) {
    for (index, ExtraTable { title, header, rows }) in subject.tables.iter().enumerate() {
        page.section(&format!("table-{index}"), title);
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        page.table(&header, rows.iter().map(Vec::as_slice));
    }
}

/// How it was found.
pub(super) fn stages(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    page.section("stages", "How it was found");
    let row = |stage: &crate::calibrate::StageReport| {
        let loss = [stage.loss_before, stage.loss_after].map(|loss| format!("{loss:.4e}"));
        [stage.name.clone(), stage.iterations.to_string()].into_iter().chain(loss).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = report.stages.iter().map(row).collect();
    page.table(&["stage", "iterations", "loss before", "loss after"], rows.iter().map(Vec::as_slice));
    page.paragraph(if report.converged {
        "The last stage reached a minimum."
    } else {
        "The last stage reached no minimum."
    });
}

/// What a reader may do.
pub(super) fn next(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    let mut steps = Vec::new();
    if !report.converged {
        steps.push(
            "Record more varied motions, or give what is known in a rig file: the fit has not settled.".to_owned(),
        );
    }
    if !report.findings.is_empty() {
        steps.push(
            "Look at what does not fit, above: mend the recording or the rig where it is a mistake, and learn again."
                .to_owned(),
        );
    }
    let cures = report
        .weak
        .iter()
        .filter(|weak| !weak.cure.is_empty())
        .map(|weak| format!("To determine more: {}.", weak.cure));
    steps.extend(cures.take(3));
    steps.push("Judge the rig on samples that it has not seen: handeye evaluate.".to_owned());
    page.section("next", "What to do next");
    page.list(&steps);
}
