//! The page of a calibration.
use super::page::{About, Folded, Page};
use super::sections::{WORST, sample_cells, sample_header};
use super::{arm, noise, residuals, sections, values, verdict};
use crate::Error;
use crate::calibrate::{
    Calibration, Combination, DeterminedBy, Influence, SuggestOptions, SuggestedSample, Suggestion, TargetReport,
    camera_poses_in_words, combinations_in_words, findings_in_words, length_in_words, lenses_in_words,
    most_influential, overstated_noise, suggest, times,
};
use crate::recording::Recording;
use crate::rig::Rig;

/// What a report on a calibration is made of.
pub struct Subject<'a> {
    /// What stands at the top, such as the names of the file that was written and of the recordings.
    pub about: About<'a>,
    /// What was known before.
    pub before: &'a Rig,
    /// What was learned, and how.
    pub calibration: &'a Calibration,
    /// What it was learned from.
    pub recording: &'a Recording,
    /// Where to move next, if that is known.
    pub suggestion: Option<&'a Suggestion>,
    /// What further tables there are: a title, a header and rows of cells.
    pub tables: &'a [ExtraTable],
}

/// A table that somebody adds to a report.
pub struct ExtraTable {
    /// Above it.
    pub title: String,
    /// Names of its columns.
    pub header: Vec<String>,
    /// Its cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// A sentence for the first section, on what it says in all; empty where there is none.
    pub in_short: String,
}

/// Positions to move to next that a page suggests.
const SUGGESTED: usize = 3;

/// Numbers that move less than this share of the largest are only counted.
const LEAST_SHARE: f64 = 0.01;

/// Numbers of a combination that a page has at most: those of a thousand features would be megabytes.
const NUMBERS: usize = 200;

/// Where to move next, for [`Subject::suggestion`]; `None` where that cannot be said, as for an arm of which no range is known. `before`: the
/// rig that learning started from.
pub fn suggestion(learned: &Rig, recording: &Recording, before: &Rig) -> Option<Suggestion> {
    let options = SuggestOptions { count: SUGGESTED, near: true, ..SuggestOptions::default() };
    suggest(learned, Some(recording), Some(before), &options).ok()
}

/// The page of a calibration.
///
/// Errors: [`Error::Unusable`] where rig and recording do not fit.
pub fn html(subject: &Subject<'_>) -> Result<String, Error> {
    let Calibration { rig, report } = subject.calibration;
    // Where targets were learned from, pixels were not, and lenses may be unknown.
    let residuals = if report.targets.is_some() { Vec::new() } else { residuals(rig, subject.recording)? };
    let mut page = Page::new(&subject.about);
    verdict::section(&mut page, subject, &residuals);
    summary(&mut page, subject);
    sections::how_it_was_read(&mut page, &subject.about, subject.recording);
    sections::cameras(&mut page, rig, &report.cameras, &residuals);
    noise::section(&mut page, rig, &residuals, &report.findings, &overstated_noise(subject.calibration));
    sections::worst(&mut page, rig, subject.recording, &residuals, &report.findings);
    sections::coverage(&mut page, rig, subject.recording);
    arm::view(&mut page, rig, subject.recording, arm::Shown::Few)?;
    values::table(&mut page, subject);
    open(&mut page, subject);
    influence(&mut page, subject);
    extra(&mut page, subject);
    stages(&mut page, subject);
    suggested(&mut page, subject);
    next(&mut page, subject);
    Ok(page.finish())
}

/// How good it is, in a few figures, and what is wrong.
fn summary(page: &mut Page, subject: &Subject<'_>) {
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
        if tip.hangs_on_priors() {
            figures.push((tip.length(tip.by_data), "standard deviation of the tip's position by the data alone"));
            figures.push((tip.length(tip.median), "the same with what was given and measured besides"));
        } else {
            figures.push((tip.length(tip.median), "standard deviation of the tip's position"));
        }
        if !report.metric {
            figures.push(("no unit".to_owned(), "of lengths: nothing metric is known"));
        }
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
    page.list(&report.targets.as_ref().map_or_else(Vec::new, TargetReport::remarks));
    page.list(&camera_poses_in_words(subject.calibration));
    page.list(&lenses_in_words(subject.before, subject.recording, subject.calibration));
    if report.findings.is_empty() {
        page.paragraph("Nothing in the recording stands out as wrong.");
    } else {
        page.paragraph("What does not fit; none of the figures above count what was left out:");
        page.list(&findings_in_words(&report.findings, true));
    }
}

/// What the data leave open.
fn open(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    page.section("open", "What the recording cannot tell");
    if report.gauge.is_empty() && report.weak.is_empty() {
        page.paragraph("Nothing: everything that was to be learned is determined by the recording.");
        return;
    }
    let of_weak = combinations_in_words(&report.weak);
    let rules: Vec<String> = report.gauge.iter().filter(|line| !of_weak.contains(line)).cloned().collect();
    page.list(&rules);
    if report.weak.is_empty() {
        return;
    }
    page.paragraph(
        "What can move together without the recording objecting much. How far it moves a camera against what that is mounted on, and the tip against \
         the base, is one standard deviation; what moves neither does not matter for the use of either.",
    );
    page.folded_list(&report.weak.iter().map(combination).collect::<Vec<_>>());
}

/// What moves and what that means, with all its numbers to unfold.
fn combination(weak: &Combination) -> Folded {
    let by = match weak.determined_by {
        DeterminedBy::Nothing => "nothing determines this".to_owned(),
        DeterminedBy::Prior(ratio) if ratio.is_finite() => {
            format!("what is given determines this {} as well as the data", times(ratio))
        }
        DeterminedBy::Prior(_) => "only what is given determines this".to_owned(),
        DeterminedBy::Poorly { .. } => "the data determine this, and poorly".to_owned(),
    };
    let matters = match weak.determined_by {
        DeterminedBy::Nothing => ", without bound".to_owned(),
        _ => format!("; {}", weak.matters()),
    };
    let cure = if weak.cure.is_empty() { String::new() } else { format!(" What would help: {}.", weak.cure) };
    let moves = weak.moves.strip_prefix("the ").map_or_else(|| weak.moves.clone(), |rest| format!("The {rest}"));
    let counts = weak.numbers.iter().filter(|(_, by)| by.abs() >= LEAST_SHARE);
    let numbers: Vec<String> = counts.take(NUMBERS).map(|(path, by)| format!("{by:+.3} {path}")).collect();
    let rest = weak.numbers.len() - numbers.len();
    let more = (rest > 0).then(|| format!("and {rest} that move less"));
    Folded {
        words: format!("{moves}: {by}{matters}.{cure}"),
        summary: format!("its {} numbers, and how far each moves", weak.numbers.len()),
        more: numbers.into_iter().chain(more).collect::<Vec<_>>().join(", "),
    }
}

/// The samples on which the result hangs.
fn influence(page: &mut Page, subject: &Subject<'_>) {
    let report = &subject.calibration.report;
    let most = most_influential(&report.influence, WORST);
    if most.is_empty() {
        return;
    }
    page.section("influence", "The samples that matter most");
    page.paragraph("How far the tip would move without each of them.");
    let has_points = report.points.observations > 0;
    let row = |one: &Influence| {
        let tip = match one.tip {
            Some(tip) if tip.is_finite() => length_in_words(tip, report.metric),
            _ => "without bound".to_owned(),
        };
        let mm = has_points.then(|| format!("{:.3}", 1e3 * one.rms_points_m));
        let cells = [tip, format!("{:.3}", one.rms_px)].into_iter().chain(mm);
        sample_cells(subject.recording, one.sample).into_iter().chain(cells).collect()
    };
    let rows: Vec<Vec<String>> = most.iter().map(row).collect();
    let figures = ["tip moves by", "its rms px"].into_iter().chain(has_points.then_some("its rms mm"));
    let header: Vec<&str> = sample_header(subject.recording).into_iter().chain(figures).collect();
    page.table(&header, rows.iter().map(Vec::as_slice));
}

/// Joint positions to record next, and what they would buy.
fn suggested(page: &mut Page, subject: &Subject<'_>) {
    let Some(suggestion) = subject.suggestion else { return };
    let length = |length: f64| length_in_words(length, suggestion.metric);
    page.section("suggested", "Where to move next");
    let of_samples = subject.calibration.report.tip.map(|tip| {
        format!(
            " (in the median over the recorded samples, as it stands at the top, it is {})",
            tip.length(tip.by_data)
        )
    });
    page.paragraph(&format!(
        "Joint positions near where the joints have been that would shrink the uncertainty of the tip most, the most valuable first; obstacles are \
         not known (`handeye suggest` looks in the whole range, and keeps what `--above` says above the table). Now it is known to {} by the data, and to {} with what is given beside them, in the median over the whole workspace of the arm{}. More motions \
         shrink what the data leave, and hardly what comes from what is given.",
        length(suggestion.now),
        length(suggestion.with_priors),
        of_samples.unwrap_or_default()
    ));
    let joints = &subject.calibration.rig.robot.joints;
    let row = |(number, sample): (usize, &SuggestedSample)| {
        let values = sample.joints.iter().map(|value| format!("{value:.3}"));
        let bought = [sample.in_view.to_string(), length(sample.tip), length(sample.tip_random)];
        [(number + 1).to_string()].into_iter().chain(values).chain(bought).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = suggestion.samples.iter().enumerate().map(row).collect();
    let mut header = vec!["position"];
    header.extend(joints.iter().map(|joint| joint.name.as_str()));
    header.extend(["in view", "tip then known to", "with random ones"]);
    page.table(&header, rows.iter().map(Vec::as_slice));
}

/// Tables that were given along.
fn extra(page: &mut Page, subject: &Subject<'_>) {
    for (index, ExtraTable { title, header, rows, .. }) in subject.tables.iter().enumerate() {
        page.section(&format!("table-{index}"), title);
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        page.table(&header, rows.iter().map(Vec::as_slice));
    }
}

/// How it was found.
fn stages(page: &mut Page, subject: &Subject<'_>) {
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
fn next(page: &mut Page, subject: &Subject<'_>) {
    page.section("next", "What to do next");
    page.list(&verdict::steps(subject));
}
