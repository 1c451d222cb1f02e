//! `handeye suggest`: where to move next.
use super::answer::Answer;
use super::inputs::{check_output, files_read, read_recordings, read_rig};
use super::reading::Reading;
use super::table::Table;
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::calibrate::{SuggestOptions, SuggestedSample, Suggestion, length_in_words, suggest};
use handeye::chain::JointKind;
use handeye::recording::{RecordedCamera, Recording, Sample};
use handeye::rig::{Camera, Rig, files_named};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Say at which joint positions to record next, and what that would buy
///
/// The positions that shrink the uncertainty of the tip's position most, within the joints' limits (else the range that they were
/// in while the rig was learned) and with at least half of the features in view of a camera, on the side on which they were seen.
/// Nothing is known of obstacles but what --above and --near say: look at every position before the robot goes there. Without --with
/// it is a ranking: the standard deviations of a rig do not say what moves together, and every feature counts as seen from all sides.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye suggest learned.toml --count 5 --with motions.jsonl -o next.jsonl
  handeye suggest arm.toml --with motions.jsonl --rig ur5      as calibrate motions.jsonl --rig ur5 -o arm.toml learned it
  handeye suggest learned.toml --with motions.jsonl --near --above 0.05      near where it was, and 5 cm above the table
  handeye suggest learned.toml                                 a ranking, where the recording is lost")]
pub struct Suggest {
    /// A rig file that calibrate wrote
    #[arg(value_name = "LEARNED")]
    learned: PathBuf,
    /// How many joint positions
    #[arg(long, value_name = "N", default_value_t = SuggestOptions::default().count)]
    count: usize,
    /// The recordings that it was learned from
    #[arg(long, value_name = "REC", num_args = 1..)]
    with: Vec<PathBuf>,
    /// What was known when it was learned: the --rig of calibrate [default: nothing but what [estimate] holds or knows roughly]
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// Stay within the ranges that the joints were in while the rig was learned, and a quarter of these ranges more
    #[arg(long)]
    near: bool,
    /// Height in the world (z) that no link, and nothing on the arm, goes below
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    above: Option<f64>,
    /// Seed of every random choice: the same seed gives the same positions
    #[arg(long, value_name = "S", default_value_t = SuggestOptions::default().seed)]
    seed: u64,
    /// A recording to write, of the joints alone: positions for a robot to visit
    #[arg(short, long, value_name = "REC")]
    output: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
}

impl Suggest {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.learned)?;
        let known = self.rig.as_deref().map(read_rig).transpose()?;
        let recording = if self.with.is_empty() {
            self.reading.refuse_without_recording()?;
            None
        } else {
            Some(read_recordings(&self.with, Some(&input), &self.reading)?)
        };
        if let Some(output) = &self.output {
            let of_rigs = [Some(&self.learned), self.rig.as_ref()].into_iter().flatten();
            let mut inputs = files_read(&self.with, None, &self.reading);
            of_rigs.for_each(|rig| inputs.extend([rig.clone()].into_iter().chain(files_named(rig))));
            check_output(output, &inputs)?;
        }
        let options = SuggestOptions { count: self.count, seed: self.seed, near: self.near, above: self.above };
        let known = known.map(|known| as_learned(known.rig, &input.rig));
        let suggestion = suggest(&input.rig, recording.as_ref(), known.as_ref(), &options)?;
        let mut answer = Answer::new(text(&input.rig, &suggestion), json(&suggestion));
        if let Some(output) = &self.output {
            to_visit(&input.rig, &suggestion).write(output)?;
            answer.json["recording"] = json!(output.display().to_string());
            answer.text +=
                &format!("\nnext: record there what {} says, then calibrate with both recordings\n", output.display());
        }
        Ok(answer)
    }
}

/// The rig that was given, with what was said besides when the other was learned: what is held, measured lengths, and where cameras are that it does not list.
fn as_learned(mut given: Rig, learned: &Rig) -> Rig {
    for Camera { name, parent, .. } in &learned.cameras {
        if !given.cameras.iter().any(|camera| camera.name == *name) {
            given.cameras.push(Camera { name: name.clone(), parent: *parent, ..Camera::default() });
        }
    }
    for pattern in &learned.estimate.fixed {
        if !given.estimate.fixed.contains(pattern) {
            given.estimate.fixed.push(pattern.clone());
        }
    }
    given.estimate.tag_side = given.estimate.tag_side.or(learned.estimate.tag_side);
    let of_given = std::mem::take(&mut given.estimate.lengths);
    learned.estimate.lengths.iter().cloned().chain(of_given).for_each(|length| given.estimate.measure(length));
    given
}

/// The positions as a recording in which nothing was seen yet.
fn to_visit(rig: &Rig, suggestion: &Suggestion) -> Recording {
    let sample = |one: &SuggestedSample| Sample { joints: Some(one.joints.clone()), ..Sample::default() };
    Recording {
        joints: rig.robot.joint_names(),
        // No lens: it would come back as known beforehand.
        cameras: rig.cameras.iter().map(name_and_size).collect(),
        features: Vec::new(),
        samples: suggestion.samples.iter().map(sample).collect(),
    }
}

fn name_and_size(camera: &Camera) -> RecordedCamera {
    RecordedCamera { name: camera.name.clone(), size: camera.size, ..RecordedCamera::default() }
}

fn text(rig: &Rig, suggestion: &Suggestion) -> String {
    let joints = &rig.robot.joints;
    let mut header = vec!["position"];
    header.extend(joints.iter().map(|joint| joint.name.as_str()));
    header.push("in view");
    let mut positions = Table::new(&header);
    let reading = |(value, kind): (f64, JointKind)| match kind {
        JointKind::Revolute => format!("{value:.3} ({:.1}°)", value.to_degrees()),
        JointKind::Prismatic => format!("{value:.4} m"),
    };
    for (number, sample) in suggestion.samples.iter().enumerate() {
        let values = sample.joints.iter().copied().zip(joints.iter().map(|joint| joint.kind)).map(reading);
        positions.row([(number + 1).to_string()].into_iter().chain(values).chain([sample.in_view.to_string()]));
    }
    let length = |length: f64| length_in_words(length, suggestion.metric);
    let mut bought = Table::new(&["positions added", "tip known to", "as many random ones"]);
    bought.row(["0".to_owned(), length(suggestion.now), length(suggestion.now)]);
    for (number, sample) in suggestion.samples.iter().enumerate() {
        bought.row([(number + 1).to_string(), length(sample.tip), length(sample.tip_random)]);
    }
    let unit = if suggestion.metric { "" } else { "; nothing metric is known, so in the model's unit" };
    let mut text = format!(
        "{} to record next, the most valuable first (rad, or m where it says so; obstacles are not known):\n{positions}\n\
         what they would buy (standard deviation of the tip's position, median over the workspace{unit}):\n{bought}",
        count(suggestion.samples.len(), "joint position"),
    );
    if suggestion.with_priors > 1.1 * suggestion.now {
        text += &format!(
            "\nwith what is given beside the data, the tip is known to {}, which more motions hardly change\n",
            length(suggestion.with_priors)
        );
    }
    if suggestion.stood_in {
        text += &format!(
            "\nthis is a ranking more than a prediction: {} in the same ranges of the joints stand in for those that the rig was \
             learned from; --with RECORDING computes with these\n",
            count(suggestion.learned_from, "random sample")
        );
    }
    text
}

fn json(suggestion: &Suggestion) -> Value {
    let sample = |one: &SuggestedSample| json!({ "joints": one.joints, "in_view": one.in_view, "tip_sd": one.tip, "tip_sd_random": one.tip_random });
    json!({
        "samples": suggestion.samples.iter().map(sample).collect::<Vec<_>>(),
        "tip_sd": suggestion.now,
        "tip_sd_with_priors": suggestion.with_priors,
        "metric": suggestion.metric,
        "learned_from": suggestion.learned_from,
        "stood_in": suggestion.stood_in,
    })
}
