//! `handeye evaluate`: how well a rig predicts a recording.
use super::answer::Answer;
use super::inputs::{check_output, read_recordings, read_rig, write_output};
use super::reading::Reading;
use super::words::{cameras_json, count, error_table, errors_json, mm, px};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{Evaluation, evaluate};
use handeye::report::evaluation_html;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Samples whose median distance exceeds this many times that of all are named: with Gaussian noise and a dozen detections
/// in a sample, one in a million does.
const CONSPICUOUS: f64 = 3.0;

/// Most samples that are named.
const NAMED: usize = 5;

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
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let recording = read_recordings(&self.recordings, Some(&input), &self.reading)?;
        if let Some(page) = &self.report {
            let inputs: Vec<PathBuf> = self.recordings.iter().chain([&self.rig]).cloned().collect();
            check_output(page, &inputs)?;
        }
        let evaluation = evaluate(&input.rig, &recording)?;
        if let Some(path) = &self.report {
            let recordings: Vec<String> = self.recordings.iter().map(|path| path.display().to_string()).collect();
            let title = format!("{} on {}", self.rig.display(), recordings.join(", "));
            let page = evaluation_html(&title, &input.rig, &recording, &evaluation)?;
            write_output(path, &page)?;
        }
        Ok(Answer::new(text(&evaluation), json(&evaluation)))
    }
}

/// What an evaluation found, as the one object of `--json`.
pub fn json(evaluation: &Evaluation) -> Value {
    let mut object = errors_json(&evaluation.total);
    object.insert("samples".to_owned(), json!(evaluation.samples));
    object.insert("rejected".to_owned(), json!(evaluation.rejected));
    object.insert("cameras".to_owned(), cameras_json(&evaluation.cameras));
    object.insert("sample_median_px".to_owned(), json!(evaluation.sample_median_px));
    if evaluation.total.points.observations > 0 {
        let medians = evaluation.sample_median_m.iter().map(|median| median.map(|m| 1e3 * m));
        object.insert("sample_median_mm".to_owned(), medians.collect());
    }
    Value::Object(object)
}

fn text(evaluation: &Evaluation) -> String {
    let Evaluation { samples, rejected, total, cameras, sample_median_px, sample_median_m } = evaluation;
    let mut text = format!("predicted {} of {}\n\n", count(total.observations, "detection"), count(*samples, "sample"));
    text += &error_table(cameras, total, *rejected).to_string();
    if *rejected > 0 {
        text += &format!(
            "\n{} left out: the rig does not know the camera or feature, or the sample has neither joints nor a tip pose\n",
            count(*rejected, "detection")
        );
    }
    if total.behind > 0 {
        text += &format!("\n{} predicted behind the camera\n", count(total.behind, "detection"));
    }
    let pixels = conspicuous(sample_median_px, total.median_px, |median| format!("{} px", px(median)));
    let points = conspicuous(sample_median_m, total.points.median_m, |median| format!("{} mm", mm(median)));
    text + &pixels + &points
}

/// The samples that are far from what is predicted, and how far. `usual`: the median of all.
fn conspicuous(medians: &[Option<f64>], usual: f64, in_words: impl Fn(f64) -> String) -> String {
    let pair = |(sample, median): (usize, &Option<f64>)| median.map(|median| (sample, median));
    let mut far: Vec<(usize, f64)> = medians.iter().enumerate().flat_map(pair).collect();
    far.retain(|(_, median)| *median > CONSPICUOUS * usual);
    far.sort_by(|a, b| b.1.total_cmp(&a.1));
    if far.is_empty() {
        return String::new();
    }
    let mut text = format!("\n{} far from what is predicted:\n", count(far.len(), "sample"));
    for (sample, median) in far.into_iter().take(NAMED) {
        text += &format!("  sample {sample}: {} in the median\n", in_words(median));
    }
    text
}
