//! `handeye check`: what a rig file says, and whether a recording goes with it.
use super::answer::Answer;
use super::counts::Counts;
use super::inputs::{RigInput, eye_in_hand, read_rig, read_with_notes};
use super::progress::Steps;
use super::reading::Reading;
use super::survey::Survey;
use super::table::Table;
use super::words::{count, list};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{Options, states_in_words};
use handeye::doctor::{Diagnosis, Misfit, examine_watched};
use handeye::rig::{Camera, Model, Parent, Rig};
use serde_json::json;
use std::path::PathBuf;

/// Say what a rig file knows, leaves open and holds, and whether a recording fits it
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye check arm.toml
  handeye check arm.toml motions.jsonl    before spending time on learning")]
pub struct Check {
    /// A rig file, or the name of a shipped rig
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Recordings to hold against it
    #[arg(value_name = "REC")]
    recordings: Vec<PathBuf>,
    /// Cameras that the rig does not list are on the hand, and what they see stands in the world
    #[arg(long)]
    eye_in_hand: bool,
    #[command(flatten)]
    reading: Reading,
}

impl Check {
    pub fn run(&self, is_json: bool) -> Result<Answer, Error> {
        if self.recordings.is_empty() {
            self.reading.refuse_without_recording()?;
            if self.eye_in_hand {
                return Err(Error::Unusable("no recording is read, where --eye-in-hand has no effect".to_owned()));
            }
        }
        let input = read_rig(&self.rig)?;
        let RigInput { rig, name, .. } = &input;
        let counts = Counts::new(rig);
        let total = counts.total();
        let is_complete = Model::new(rig).is_ok() && !rig.cameras.is_empty() && !rig.features.is_empty();
        let mut text = describe(rig, name, &counts);
        let next = if is_complete {
            "it is complete: it can be simulated and evaluated"
        } else {
            "what is unknown is learned: handeye calibrate REC --rig RIG -o LEARNED"
        };
        text += &format!("\n{next}\n");
        let mut json = json!({
            "rig": name,
            "name": rig.name,
            "joints": rig.robot.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
            "cameras": rig.cameras.iter().map(|camera| &camera.name).collect::<Vec<_>>(),
            "features": rig.features.iter().map(|feature| &feature.name).collect::<Vec<_>>(),
            "targets": rig.targets.iter().map(|target| &target.name).collect::<Vec<_>>(),
            "known": total.known,
            "unknown": total.unknown,
            "held": total.held,
            "parameters": counts.json(),
            "unknown_paths": counts.unknown,
            "held_paths": counts.held,
            "complete": is_complete,
        });
        if !self.recordings.is_empty() {
            let (recording, notes) = read_with_notes(&self.recordings, Some(&input), &self.reading, &[])?;
            let mut placed = rig.clone();
            if self.eye_in_hand {
                eye_in_hand(&mut placed, &recording)?;
            }
            let rig = &placed;
            let survey = Survey::new(rig, &recording);
            text += &format!("\n{survey}");
            json["recording"] = survey.json();
            if !notes.is_empty() {
                text += &format!("\nhow it was read:\n{}", lines(&notes));
            }
            json["notes"] = json!(notes);
            match states_in_words(rig, &recording) {
                Ok(states) => {
                    text += &format!("\nthe robot's state:\n{}", lines(&states));
                    json["states"] = json!(states);
                }
                Err(error) => text += &format!("\nthe robot's state is not known: {error}\n"),
            }
            let mut steps = Steps::new(is_json);
            let diagnosis = examine_watched(rig, &recording, &Options::default(), &mut |hypothesis, progress| {
                steps.show(hypothesis, progress);
            });
            drop(steps);
            if let Some(thinned_to) = diagnosis.thinned_to {
                let samples = recording.samples.len();
                text +=
                    &format!("\nhypotheses are held against {thinned_to} of the {samples} samples, spread evenly\n");
            }
            json["thinned_to"] = json!(diagnosis.thinned_to);
            text += &format!("\n{}", tell(&diagnosis));
            json["misfit_over_noise"] = json!(over_noise(&diagnosis));
            json["scores"] = diagnosis
                .scores
                .iter()
                .map(|score| match score.misfit {
                    None => json!({ "alternative": score.alternative }),
                    Some(Misfit::Pixels(px)) => json!({ "alternative": score.alternative, "median_px": px }),
                    Some(Misfit::Points(m)) => json!({ "alternative": score.alternative, "median_mm": 1e3 * m }),
                    Some(Misfit::Poses { turn, shift }) => {
                        json!({ "alternative": score.alternative, "median_rad": turn, "median_m": shift })
                    }
                })
                .collect();
            json["unsolved"] = json!(diagnosis.unsolved);
            json["findings"] = diagnosis.findings.iter().map(|f| json!({"what": f.what, "change": f.change})).collect();
        }
        Ok(Answer::new(text, json))
    }
}

fn lines(lines: &[String]) -> String {
    lines.iter().map(|line| format!("  {line}\n")).collect()
}

/// The misfit of the data as recorded, in relation to noise.
fn over_noise(diagnosis: &Diagnosis) -> Option<f64> {
    diagnosis.scores.first()?.misfit?.over_noise(&diagnosis.noise)
}

fn tell(diagnosis: &Diagnosis) -> String {
    let noise = &diagnosis.noise;
    let mut table = Table::new(&["if", "median misfit"]);
    for score in &diagnosis.scores {
        let cell = score.misfit.map_or_else(|| "no fit".to_owned(), |misfit| misfit.to_string());
        table.row([score.alternative.clone(), cell]);
    }
    let mut text = if diagnosis.scores.is_empty() { String::new() } else { table.to_string() };
    if let Some(reason) = &diagnosis.unsolved {
        text += &format!("\nnothing can be learned from the data as recorded: {reason}\n");
    }
    let misfit = diagnosis.scores.first().and_then(|score| score.misfit);
    let fits = misfit.and_then(|misfit| Some((misfit, misfit.of_noise(noise)?, misfit.over_noise(noise)?)));
    let fits = fits.map(|(misfit, expected, ratio)| {
        let is_explained = misfit.is_explained(noise);
        text += &if is_explained {
            let in_the_median = if diagnosis.findings.is_empty() { "" } else { " in the median" };
            format!("\nas recorded it fits{in_the_median}: {misfit}, where the rig's [noise] leaves {expected}\n")
        } else {
            format!("\nas recorded it does not fit: {misfit} is {ratio:.1} times the {expected} that the rig's [noise] leaves\n")
        };
        is_explained
    });
    if diagnosis.findings.is_empty() && diagnosis.unsolved.is_none() {
        text += "\nno mistake in units, pairing, axes or sides was found\n";
        if fits == Some(false) {
            text += "what does not fit may be the rig: another robot, numbers held that are wrong, a target that slipped, a camera that moved; or \
                     its [noise], where less was stated than there is\n";
        }
    }
    for finding in &diagnosis.findings {
        text += &format!("\n  {}: {}\n", finding.what, finding.change);
    }
    text
}

fn describe(rig: &Rig, file: &str, counts: &Counts) -> String {
    let mut text = rig.name.as_ref().map_or_else(|| format!("{file}\n"), |name| format!("{file}: {name}\n"));
    let joints = rig.robot.joint_names();
    if joints.is_empty() {
        text += "  joints    as many as the recording has\n";
    } else {
        let convention = rig.robot.convention.name();
        text += &format!("  joints    {}, {convention}: {}\n", joints.len(), list(&joints));
    }
    let cameras: Vec<String> = rig.cameras.iter().map(|camera| describe_camera(rig, camera)).collect();
    if cameras.is_empty() {
        text += "  cameras   those of the recording\n";
    } else {
        text += &format!("  cameras   {}: {}\n", cameras.len(), list(&cameras));
    }
    let features: Vec<String> = rig.features.iter().map(|feature| feature.name.clone()).collect();
    if features.is_empty() {
        text += "  features  those of the recording\n";
    } else {
        text += &format!("  features  {}: {}\n", features.len(), list(&features));
    }
    let targets: Vec<String> =
        rig.targets.iter().map(|target| format!("{} ({})", target.name, place(rig, target.parent))).collect();
    if !targets.is_empty() {
        text += &format!("  targets   {}: {}\n", targets.len(), list(&targets));
    }
    if let Some([side, sd]) = rig.estimate.tag_side {
        text += &format!("  measured  the sides of tags: {:.2} ± {:.2} mm\n", 1e3 * side, 1e3 * sd);
    }
    for length in &rig.estimate.lengths {
        let (mm, sd) = (1e3 * length.length, 1e3 * length.sd);
        text += &format!("  measured  {}: {mm:.2} ± {sd:.2} mm\n", length.between);
    }
    if let Some(fit) = &rig.fit {
        let (samples, rejected) = (count(fit.samples, "sample"), fit.rejected);
        let points = fit.rms_points_m.map_or_else(String::new, |rms| format!(" points {:.3} mm rms,", 1e3 * rms));
        // A rig that was learned from points alone has no pixel error.
        let is_pixels = fit.rms_points_m.is_none() || fit.rms_px > 0.0;
        let pixels = if is_pixels { format!(" {:.3} px rms,", fit.rms_px) } else { String::new() };
        text += &format!("  learned   from {samples},{pixels}{points} {rejected} detections left out\n");
    }
    text += &format!("\n{}", counts.table());
    for (what, paths) in [("unknown", &counts.unknown), ("held", &counts.held)] {
        if !paths.is_empty() {
            text += &format!("\n{what}: {}\n", list(paths));
        }
    }
    if !rig.estimate.prior.is_empty() {
        let priors: Vec<String> = rig.estimate.prior.iter().map(|(path, sd)| format!("{path} ± {sd}")).collect();
        text += &format!("\npriors: {}\n", list(&priors));
    }
    text
}

fn describe_camera(rig: &Rig, camera: &Camera) -> String {
    let size = camera.size.map_or_else(String::new, |[width, height]| format!(", {width} x {height}"));
    let model = camera.model.map_or_else(String::new, |model| format!(", {}", model.name()));
    let depth = if camera.depth { ", depth" } else { "" };
    format!("{} ({}{depth}{model}{size})", camera.name, place(rig, camera.parent))
}

fn place(rig: &Rig, parent: Parent) -> String {
    match parent {
        Parent::World => "in the world".to_owned(),
        Parent::Tip => "on the tip".to_owned(),
        Parent::Link(joint) => format!("on link {}", rig.robot.joints[joint].name),
    }
}
