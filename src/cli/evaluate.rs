//! `handeye evaluate`: how well a rig predicts a recording.
use super::answer::Answer;
use super::calibrate::{finding_json, with};
use super::inputs::{check_output, files_read, read_and_remark, read_rig, write_output};
use super::reading::Reading;
use super::words::{cameras_json, count, error_table, errors_json, file_name, file_names, list, mm, px, seconds};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{Distance, Evaluation, ReadingNoise, SpaceErrors, evaluate, findings_in_words};
use handeye::recording::Recording;
use handeye::report::{About, evaluation_html, evaluation_steps};
use handeye::rig::Rig;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Predict the pixels and points of a recording from its joints, and compare
///
/// A recording that the rig was not learned from tells how good the rig is; its own tells only how well it was fitted.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye evaluate learned.toml fresh.jsonl
  handeye evaluate learned.toml fresh.jsonl --report page.html")]
pub struct Evaluate {
    /// A rig file in which every value is given
    #[arg(value_name = "LEARNED")]
    rig: PathBuf,
    /// Recordings of that rig
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// Also write a page to read: residuals of every camera, coverage, worst samples, a view that can be turned
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
}

impl Evaluate {
    pub fn run(&self, typed: &str) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let (recording, notes) = read_and_remark(&self.recordings, Some(&input), &self.reading, &[])?;
        if let Some(page) = &self.report {
            let inputs = files_read(&self.recordings, Some(&self.rig), &self.reading);
            check_output(page, &[inputs, vec![self.rig.clone()]].concat())?;
        }
        let evaluation = evaluate(&input.rig, &recording)?;
        if let Some(path) = &self.report {
            let title = format!("{} on {}", file_name(&self.rig), file_names(&self.recordings));
            let about = About { title: &title, command: typed, notes: &notes };
            let page = evaluation_html(&about, &input.rig, &recording, &evaluation)?;
            write_output(path, &page)?;
        }
        let mut answer = Answer::new(text(&input.rig, &recording, &evaluation), json(&input.rig, &evaluation));
        answer.json["notes"] = json!(notes);
        Ok(answer)
    }
}

/// What an evaluation found, as the one object of `--json`.
pub fn json(rig: &Rig, evaluation: &Evaluation) -> Value {
    let mut object = errors_json(&evaluation.total);
    object.insert("samples".to_owned(), json!(evaluation.samples));
    object.insert("rejected".to_owned(), json!(evaluation.rejected));
    object.insert("cameras".to_owned(), cameras_json(&evaluation.cameras));
    object.insert("sample_median_px".to_owned(), json!(evaluation.sample_median_px));
    if evaluation.total.points.observations > 0 {
        let medians = evaluation.sample_median_m.iter().map(|median| median.map(|m| 1e3 * m));
        object.insert("sample_median_mm".to_owned(), medians.collect());
    }
    object.insert("in_space".to_owned(), space_json(evaluation.space));
    object.insert("learned_from_it".to_owned(), json!(evaluation.is_own));
    let (of_readings, _) = &evaluation.reading_noise;
    let in_mm = (evaluation.total.points.observations > 0).then_some(1e3 * of_readings.m);
    object.insert("reading_noise".to_owned(), json!({ "rms_px": of_readings.px, "rms_mm": in_mm }));
    let poor = evaluation.fitting.poor.iter().map(|(sample, off)| with(json!({ "sample": sample }), "median", off));
    object.insert("fit_worst".to_owned(), poor.collect());
    let mut fitting = errors_json(&evaluation.fitting.total);
    fitting.insert("in_space".to_owned(), space_json(evaluation.fitting.space));
    fitting.insert("cameras".to_owned(), cameras_json(&evaluation.fitting.cameras));
    object.insert("without_what_does_not_fit".to_owned(), Value::Object(fitting));
    let findings = evaluation.misfits.iter().chain(&evaluation.fitting.findings);
    object.insert("findings".to_owned(), findings.map(|one| finding_json(one, one.of_evaluation())).collect());
    object.insert("next".to_owned(), json!(evaluation_steps(rig, evaluation)));
    Value::Object(object)
}

fn space_json(space: Option<SpaceErrors>) -> Value {
    let json = |SpaceErrors { median_m, p95_m }| json!({ "median_mm": 1e3 * median_m, "p95_mm": 1e3 * p95_m });
    space.map_or(Value::Null, json)
}

fn space_in_words(space: SpaceErrors) -> String {
    format!("{} mm in the median, and 95 % of them by no more than {} mm", mm(space.median_m), mm(space.p95_m))
}

fn text(rig: &Rig, recording: &Recording, evaluation: &Evaluation) -> String {
    let Evaluation { samples, rejected, total, cameras, fitting, .. } = evaluation;
    let mut text = format!("predicted {} of {}\n\n", count(total.observations, "detection"), count(*samples, "sample"));
    text += &error_table(cameras, total, *rejected).to_string();
    if let Some(space) = evaluation.space {
        let words = space_in_words(space);
        text += &format!("\nin space, at the depth of the features, predictions are off by {words}\n");
    }
    if *rejected > 0 {
        text += &format!(
            "\n{} left out: the rig does not know the camera or feature, or it does not follow from joints or a tip pose\n",
            count(*rejected, "detection")
        );
    }
    let (of_readings, _) = &evaluation.reading_noise;
    if *of_readings != ReadingNoise::default() {
        let parts = [
            (of_readings.px, format!("{} px", px(of_readings.px))),
            (of_readings.m, format!("{} mm", mm(of_readings.m))),
        ];
        let parts: Vec<String> = parts.into_iter().filter(|(size, _)| *size > 0.0).map(|(_, words)| words).collect();
        text += &format!("\nnoise of what was read of the robot gives {} rms of this alone\n", parts.join(" and "));
    }
    if total.behind > 0 {
        text += &format!("\n{} predicted behind the camera\n", count(total.behind, "detection"));
    }
    if !fitting.findings.is_empty() {
        let left_out: usize = fitting.cameras.iter().map(|camera| camera.rejected).sum();
        text += "\nwithout what does not fit, as calibrate leaves it out:\n\n";
        text += &error_table(&fitting.cameras, &fitting.total, left_out).to_string();
        if let Some(space) = fitting.space {
            text += &format!("\nin space that is {}\n", space_in_words(space));
        }
        text += "\nwhat does not fit:\n";
        findings_in_words(&fitting.findings, false).iter().for_each(|line| text += &format!("  {line}\n"));
    }
    if !fitting.poor.is_empty() {
        let one = |(sample, off): &(usize, Distance)| match recording.samples[*sample].time {
            Some(time) => format!("sample {sample} at {} s ({off:.1})", seconds(time)),
            None => format!("sample {sample} ({off:.1})"),
        };
        text += &format!(
            "\nfit worst, far beyond what is usual here in the median: {}\n",
            list(&fitting.poor.iter().map(one).collect::<Vec<_>>())
        );
    }
    text + &format!("\nnext: {}\n", evaluation_steps(rig, evaluation).join("\n      "))
}
