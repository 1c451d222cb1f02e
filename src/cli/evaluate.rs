//! `handeye evaluate`: how well a rig predicts a recording.
use super::answer::Answer;
use super::inputs::{read_recordings, read_rig};
use super::words::{cameras_json, count, error_table, errors_json, px};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{Evaluation, evaluate};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Samples whose median distance exceeds this many times that of all are named: with Gaussian noise and a dozen detections
/// in a sample, one in a million does.
const CONSPICUOUS: f64 = 3.0;

/// Most samples that are named.
const NAMED: usize = 5;

/// Predict the pixels of a recording from its joints, and compare
///
/// A recording that the rig was not learned from tells how good the rig is; its own tells only how well it was fitted.
#[derive(Args)]
#[command(after_help = "\
Example:
  handeye evaluate learned.toml fresh.jsonl")]
pub struct Evaluate {
    /// A rig file in which every value is given
    #[arg(value_name = "LEARNED")]
    rig: PathBuf,
    /// Recordings of that rig
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
}

impl Evaluate {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let recording = read_recordings(&self.recordings, Some(&input))?;
        let evaluation = evaluate(&input.rig, &recording)?;
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
    Value::Object(object)
}

fn text(evaluation: &Evaluation) -> String {
    let Evaluation { samples, rejected, total, cameras, sample_median_px } = evaluation;
    let mut text = format!("predicted {} of {}\n\n", count(total.observations, "detection"), count(*samples, "sample"));
    text += &error_table(cameras, total, *rejected).to_string();
    if *rejected > 0 {
        text += &format!(
            "\n{} left out: the rig does not know the feature, or the sample has no joints\n",
            count(*rejected, "detection")
        );
    }
    if total.behind > 0 {
        text += &format!("\n{} predicted behind the camera\n", count(total.behind, "detection"));
    }
    let mut conspicuous: Vec<(usize, f64)> = sample_median_px.iter().copied().enumerate().flat_map(pair).collect();
    conspicuous.retain(|(_, median)| *median > CONSPICUOUS * total.median_px);
    conspicuous.sort_by(|a, b| b.1.total_cmp(&a.1));
    if !conspicuous.is_empty() {
        text += &format!("\n{} far from what is predicted:\n", count(conspicuous.len(), "sample"));
        for (sample, median) in conspicuous.iter().take(NAMED) {
            text += &format!("  sample {sample}: {} px in the median\n", px(*median));
        }
    }
    text
}

fn pair((sample, median): (usize, Option<f64>)) -> Option<(usize, f64)> {
    median.map(|median| (sample, median))
}
