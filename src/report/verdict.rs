//! The answer in a few lines: where its cameras are, how well a rig fits, how well its tip is known, and what to do first.
use super::calibration::Subject;
use super::change;
use super::noise;
use super::page::Page;
use super::residuals::Residual;
use crate::calibrate::{CameraPose, Distance, Finding, Report, assumptions, camera_poses, overstated_noise};

/// Said where errors do not look like noise.
const OTHER_THAN_NOISE: &str =
    " The errors are not noise alone (see below), so what is given by the data is less certain than the figures say.";

/// Cameras whose poses stand at the top.
const CAMERAS: usize = 4;

/// The first section of a page.
pub(super) fn section(page: &mut Page, subject: &Subject<'_>, residuals: &[Residual]) {
    page.section("verdict", "In short");
    let next = steps(subject).into_iter().next().unwrap_or_default();
    let is_noise = noise::is_alone(&subject.calibration.rig, residuals, &subject.calibration.report.findings);
    let fit = fit(subject) + if is_noise { "" } else { OTHER_THAN_NOISE };
    let tables = subject.tables.iter().map(|table| table.in_short.clone()).filter(|words| !words.is_empty());
    let overstated = overstated_noise(subject.calibration).into_iter().map(|one| format!("But {one}."));
    let last = [tip(subject), format!("What to do next: {next}")];
    cameras(page, subject);
    page.list(&[fit].into_iter().chain(overstated).chain(tables).chain(last).collect::<Vec<_>>());
}

/// Where the cameras are, which is what most calibrate for; of many the summary tells.
fn cameras(page: &mut Page, subject: &Subject<'_>) {
    let poses = camera_poses(subject.calibration);
    if poses.is_empty() || poses.len() > CAMERAS {
        return;
    }
    let tiles = poses.iter().flat_map(|pose| {
        let CameraPose { camera, on, sd, assumed, .. } = pose;
        // The summary says what is taken as given, and what of the pose hangs on that.
        let on = if assumed.is_empty() { on.clone() } else { format!("{on} as given (see below)") };
        let [length, angle] = sd.map_or_else(<[String; 2]>::default, |sd| pose.sd_in_words(sd));
        [
            (format!("{} {length}", pose.centre_in_words()), format!("camera `{camera}`: x, y, z from {on}")),
            (format!("{} {angle}", pose.turn_in_words()), format!("camera `{camera}`: turned by (rotation vector)")),
        ]
    });
    let tiles: Vec<(String, String)> = tiles.collect();
    page.figures(&tiles.iter().map(|(figure, what)| (figure.trim().to_owned(), what.as_str())).collect::<Vec<_>>());
}

/// How well it fits, beside what the noise lets expect, and what was left out.
fn fit(subject: &Subject<'_>) -> String {
    let report = &subject.calibration.report;
    let Report { observations, points, rejected, rms_px, .. } = *report;
    let noise = &subject.calibration.rig.noise;
    let mut parts = Vec::new();
    if let Some(targets) = &report.targets {
        parts.push(format!("{:.3} mm and {:.4}° rms per axis", 1e3 * targets.rms_xyz, targets.rms_rot.to_degrees()));
    } else if observations > points.observations {
        // Two coordinates make a distance.
        let expected = noise.pixels * f64::sqrt(2.0);
        parts.push(format!(
            "{rms_px:.3} px rms, where noise of {} a coordinate gives {expected:.3} px",
            Distance::Pixels(noise.pixels).rounded()
        ));
    }
    if points.observations > 0 {
        let (rms, expected) = (1e3 * points.rms_m, 1e3 * noise.points * f64::sqrt(3.0));
        let sd = Distance::Metres(noise.points).rounded();
        parts.push(format!("{rms:.3} mm rms, where noise of {sd} a coordinate gives {expected:.3} mm"));
    }
    let left_out = match rejected {
        0 => "nothing was left out".to_owned(),
        _ => format!("{rejected} of {} detections were left out{}", rejected + observations, among(&report.findings)),
    };
    let settled = if report.converged { "" } else { " No minimum was reached, so none of this is to be relied on." };
    format!("It fits to {}; {left_out}.{settled}", parts.join(" and "))
}

/// What is behind detections that were left out.
fn among(findings: &[Finding]) -> String {
    let count = |is: fn(&Finding) -> bool| findings.iter().filter(|finding| is(finding)).count();
    let kinds = [
        (
            count(|finding| matches!(finding, Finding::WrongJoints { .. } | Finding::UnknownState { .. })),
            ["sample", "samples"],
        ),
        (count(|finding| matches!(finding, Finding::WrongImage { .. })), ["image", "images"]),
        (count(|finding| matches!(finding, Finding::CameraMoved { .. })), ["camera that moved", "cameras that moved"]),
    ];
    let words = |(n, names): (usize, [&str; 2])| (n > 0).then(|| format!("{n} whole {}", names[usize::from(n > 1)]));
    let words: Vec<String> = kinds.into_iter().filter_map(words).collect();
    if words.is_empty() { String::new() } else { format!(", among them {}", words.join(" and ")) }
}

/// How well the tip's position is known, and from what.
fn tip(subject: &Subject<'_>) -> String {
    let Some(tip) = subject.calibration.report.tip else {
        return "Of the tip's position nothing was learned, or the recording leaves it open.".to_owned();
    };
    let mut words = format!("The tip's position is known to {tip}.");
    if tip.hangs_on_priors() {
        let assumed = assumptions(subject.before, subject.recording).join(", ");
        words += &if assumed.is_empty() { String::new() } else { format!(" What was assumed: {assumed}.") };
    }
    words
}

/// What a reader may do, the most urgent first.
pub(super) fn steps(subject: &Subject<'_>) -> Vec<String> {
    let report = &subject.calibration.report;
    let mut steps = Vec::new();
    if !report.converged {
        steps.push(
            "Record more varied motions, or give what is known in a rig file: the fit has not settled.".to_owned(),
        );
    }
    if let Some(lag) = report.findings.iter().find(|finding| matches!(finding, Finding::Lag { .. })) {
        steps.push(format!("Mend the clocks, and learn again: {lag}."));
        return steps;
    }
    let misfit = |finding: &Finding| matches!(finding, Finding::Misfit { .. });
    steps.extend(report.findings.iter().filter(|one| misfit(one)).map(|one| format!("Find the reason: {one}.")));
    let is_seen = |index: &usize| {
        let sample = &subject.recording.samples[*index];
        !sample.pixels.is_empty() || !sample.points.is_empty()
    };
    let judged: Vec<usize> = (0..subject.recording.samples.len()).filter(is_seen).collect();
    let seeing = report.cameras.iter().filter(|camera| camera.errors.observations + camera.rejected > 0);
    let seeing: Vec<&str> = seeing.map(|camera| camera.name.as_str()).collect();
    let changed = change::when(&judged, &report.findings);
    steps.extend(changed.iter().map(|when| change::words(when, &seeing)));
    let moved = |finding: &Finding| match finding {
        Finding::CameraMoved { camera, .. } => Some(format!(
            "Camera `{camera}` moved: the rig has it where it was for most of the recording. `handeye calibrate --relearn cameras.{camera}` learns \
             it anew from the samples of where it is now."
        )),
        _ => None,
    };
    steps.extend(report.findings.iter().filter_map(moved));
    // Combinations that differ in little ask for the same.
    let mut cures: Vec<&str> = Vec::new();
    for cure in report.weak.iter().map(|weak| weak.cure.as_str()).filter(|cure| !cure.is_empty()) {
        let what = |cure: &str| cure.split(": it is known").next().map(str::to_owned);
        if cures.iter().all(|other| what(other) != what(cure)) {
            cures.push(cure);
        }
    }
    steps.extend(cures.into_iter().take(3).map(|cure| format!("To determine more: {cure}.")));
    let is_length = |finding: &Finding| matches!(finding, Finding::MissedLength { .. } | Finding::FarFromGiven { .. });
    if report.findings.iter().any(is_length) {
        let check = "Check what was given: the robot that the rig names, and every length. One of them contradicts the recording, and no figure in \
             millimetres holds before it is right.";
        steps.insert(0, check.to_owned());
    }
    let explained = |finding: &Finding| {
        misfit(finding)
            || is_length(finding)
            || moved(finding).is_some()
            || (changed.is_some() && change::sample_of(finding).is_some())
    };
    if report.findings.iter().any(|finding| !explained(finding)) {
        steps.push(
            "Use the rig: what does not fit was left out of it. Where that is a mistake of the recording, mending it gives more to learn from."
                .to_owned(),
        );
    }
    steps.push(if report.targets.is_some() {
        "Learn from a second recording too: the poses of both agree within a few of their standard deviations."
            .to_owned()
    } else {
        "Judge the rig on samples that it has not seen: `handeye evaluate`.".to_owned()
    });
    steps
}
