//! `handeye infer`: joints and tip poses from the pixels of a recording.
use super::answer::Answer;
use super::inputs::{read_recordings, read_rig};
use super::reading::{OfFiles, Reading, What};
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::infer::{Branch, InferOptions, Inference, Names, Prior, Sightings};
use handeye::recording::{Recording, Sample};
use handeye::rig::Rig;
use handeye::solvers::{Pose, manifold::so3};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// Infer the joints and the tip's pose from each sample's pixels and points alone
///
/// Prints JSON Lines, one object a sample: `joints`, `pose` and `rms_px` (and `rms_points_mm`) of the most probable branch, its `sd` (one number per joint)
/// and `probability`; the other `branches` where there are any; and the `open` directions of the joints that the pixels do not
/// determine, where they stay in the middle of their limits. A sample of which nothing can be told has `error` instead.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye infer learned.toml fresh.jsonl
  handeye infer learned.toml fresh.jsonl --actions     branches told apart by the motions that were commanded
  handeye infer learned.toml fresh.jsonl --readings    with the joint readings, by the noise that the rig says they have")]
pub struct Infer {
    /// A rig file in which every value is given
    #[arg(value_name = "LEARNED")]
    rig: PathBuf,
    /// Recordings of that rig
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// Follow the branches through the recorded joint actions, with the rig's `noise.joint_action`; of tables, what `action` holds
    #[arg(long, value_name = "WHAT", num_args = 0..=1, require_equals = true)]
    actions: Option<Option<What>>,
    /// Use the joint readings too, with the rig's `noise.joints`
    #[arg(long, conflicts_with = "actions")]
    readings: bool,
    /// Shifts the starts of the search: the same seed gives the same answer
    #[arg(long, value_name = "S", default_value_t = InferOptions::default().seed)]
    seed: u64,
    #[command(flatten)]
    of_files: OfFiles,
}

impl Infer {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let reading = Reading::from((&self.of_files, self.actions.flatten()));
        let recording = read_recordings(&self.recordings, Some(&input), &reading)?;
        if self.readings && input.rig.noise.joints <= 0.0 {
            let name = &input.name;
            return Err(Error::Unusable(format!(
                "{name}: --readings needs the noise of the joint readings, `joints` of [noise] above 0"
            )));
        }
        if self.actions.is_some() && recording.samples.iter().all(|sample| sample.joint_action.is_none()) {
            return Err(Error::Unusable("--actions needs samples with `joint_action`, and none has one (--actions=targets or motions says what `action` of a table holds)".to_owned()));
        }
        let options = InferOptions { seed: self.seed, ..InferOptions::default() };
        let mut inference = Inference::new(&input.rig, options)?;
        let inferred = self.infer(&mut inference, &input.rig, &recording)?;
        let failed = inferred.iter().filter(|object| object.contains_key("error")).count();
        let lines: String = inferred.iter().map(|object| format!("{}\n", Value::Object(object.clone()))).collect();
        let json = json!({ "samples": inferred.len(), "failed": failed, "inferred": inferred });
        let mut answer = Answer::new(lines, json);
        if failed == inferred.len() {
            let reason = inferred.first().and_then(|object| object["error"].as_str()).unwrap_or("there is no sample");
            answer.failure = Some(format!("nothing was inferred from {}: {reason}", count(failed, "sample")));
        }
        Ok(answer)
    }

    /// One object per sample.
    fn infer(
        &self,
        inference: &mut Inference,
        rig: &Rig,
        recording: &Recording,
    ) -> Result<Vec<Map<String, Value>>, Error> {
        let names = Names::new(rig, recording);
        let mut before: Option<(Vec<Branch>, &[f64])> = None;
        let mut objects = Vec::with_capacity(recording.samples.len());
        for (index, sample) in recording.samples.iter().enumerate() {
            let (pixels, points) = (names.sightings(sample), names.points(sample));
            let seen = Sightings { pixels: &pixels, points: &points };
            let found = match (&before, &sample.joints) {
                (Some((branches, action)), _) => inference.joints_after(branches, action, seen),
                (None, Some(joints)) if self.readings => {
                    inference.joints(seen, &Prior::readings(joints, rig.noise.joints))
                }
                _ => inference.joints(seen, &Prior::none()),
            };
            let mut object = Map::new();
            object.insert("sample".to_owned(), json!(index));
            if let Some(time) = sample.time {
                object.insert("time".to_owned(), json!(time));
            }
            match &found {
                Ok(branches) => tell(&mut object, branches, seen),
                Err(Error::NotEnoughData(reason)) => {
                    object.insert("error".to_owned(), json!(reason));
                }
                Err(_) => return found.map(|_| Vec::new()),
            }
            objects.push(object);
            before = self.moved(found.ok(), sample);
        }
        Ok(objects)
    }

    /// What the next sample is compared with.
    fn moved<'a>(&self, branches: Option<Vec<Branch>>, sample: &'a Sample) -> Option<(Vec<Branch>, &'a [f64])> {
        let action = sample.joint_action.as_deref().filter(|_| self.actions.is_some())?;
        Some((branches?, action))
    }
}

/// The most probable branch, and the others.
fn tell(object: &mut Map<String, Value>, branches: &[Branch], seen: Sightings<'_>) {
    let Some((best, others)) = branches.split_first() else { return };
    let has_points = !seen.points.is_empty();
    object.insert("detections".to_owned(), json!(seen.pixels.len() + seen.points.len()));
    object.extend(entry(best, has_points));
    if !best.open.is_empty() {
        object.insert("open".to_owned(), json!(best.open));
    }
    if !others.is_empty() {
        object.insert(
            "branches".to_owned(),
            others.iter().map(|branch| Value::Object(entry(branch, has_points))).collect(),
        );
    }
}

fn entry(branch: &Branch, has_points: bool) -> Map<String, Value> {
    let sd: Vec<f64> = branch.covariance.diagonal().iter().map(|variance| variance.sqrt()).collect();
    let pairs = [
        ("joints", json!(branch.joints)),
        ("pose", pose(&branch.pose)),
        ("rms_px", json!(branch.rms_px)),
        ("sd", json!(sd)),
        ("probability", json!(branch.probability)),
    ];
    let points = has_points.then(|| ("rms_points_mm", json!(1e3 * branch.rms_points_m)));
    pairs.into_iter().chain(points).map(|(key, value)| (key.to_owned(), value)).collect()
}

fn pose(pose: &Pose) -> Value {
    json!({ "xyz": pose.translation.as_slice(), "quat": so3::quaternion(&pose.rotation) })
}
