//! `handeye calibrate`: a recording to a learned rig.
use super::answer::{Answer, remark};
use super::counts::learned_in_words;
use super::folds::Folds;
use super::inputs::{check_output, eye_in_hand, files_read, is_same, read_and_remark, read_rig, write_output};
use super::noise;
use super::progress::Bar;
use super::reading::Reading;
use super::trust;
use super::unsaid;
use super::words::{cameras_json, count, duration, error_table, file_name, file_names, points_json};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{
    Calibration, CameraPose, Distance, Errors, Finding, LensNumber, NoiseTrial, Options, OverstatedNoise, Progress,
    Report, Sources, TargetReport, assumptions, calibrate, camera_poses, camera_poses_in_words, findings_in_words,
    hold, lenses_against_given, lenses_in_words, overstated_noise, relearn, select_noise,
};
use handeye::recording::Recording;
use handeye::report;
use handeye::rig::{Ends, Length, Rig};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Learn what is unknown of a rig from recordings, and refine the rest
///
/// Without --rig everything is learned: the joints' geometry, where the cameras are, where the features are. What a rig file
/// gives is where learning starts; what its [estimate] table holds stays. The learned rig is a rig file again.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye calibrate motions.jsonl -o learned.toml
  handeye calibrate monday.jsonl tuesday.jsonl --rig arm.toml -o learned.toml
  handeye calibrate motions.jsonl --rig ur5 -o learned.toml --folds 5   with held-out errors
  handeye calibrate motions.jsonl --rig arm.toml -o arm.toml            keeps its comments
  handeye calibrate motions.jsonl -o learned.toml --report page.html    a page to read
  handeye calibrate robot.mcap --rig ur5e --tag-side 0.06 -o arm.toml   tags that tell how large everything is
  handeye calibrate robot.mcap --rig panda --eye-in-hand -o arm.toml    a camera on the wrist, features in the world
  handeye calibrate robot.mcap --hold 'cameras.*.intrinsics' -o arm.toml   lenses stay as they were calibrated
  handeye calibrate three.jsonl --rig arm.toml --relearn cameras.left -o arm.toml   a camera that was moved
  handeye calibrate five.jsonl --rig arm.toml --relearn cameras.top -o arm.toml     a camera that is new
  handeye calibrate two.jsonl --rig arm.toml --relearn 'features.tool*' -o arm.toml another object in the gripper")]
pub struct Calibrate {
    /// Recordings of one rig
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// What is known of the rig: a rig file, or the name of a shipped rig
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// The rig file to write; may be that of --rig
    #[arg(short, long, value_name = "LEARNED")]
    output: PathBuf,
    /// Also learn K times without every K-th sample, and report how well those are predicted
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..))]
    folds: Option<u32>,
    /// Learn these parameters anew from few samples and hold everything else: cameras.left, features, robot.base, with *;
    /// cameras and features that only the recording has are added
    #[arg(long, value_name = "PATH", requires = "rig", conflicts_with_all = ["select_noise", "folds"])]
    relearn: Vec<String>,
    /// Estimate the noise of pixels, points, joints, poses and actions from the data; [noise] of the rig is where that starts
    #[arg(long)]
    estimate_noise: bool,
    /// Also report how far leaving out each sample would move the tip, and which samples fit worst
    #[arg(long)]
    influence: bool,
    /// Pick the noise of joints or poses, relative to that of pixels, by how well samples held out are predicted
    #[arg(long, conflicts_with = "estimate_noise")]
    select_noise: bool,
    /// A distance that was measured between two features, or cameras.A and cameras.B, and its standard deviation [m] [default: 0.0005]; may be
    /// given more than once
    #[arg(long, value_name = "A,B=METRES[,SD]", value_parser = read_length)]
    length: Vec<Length>,
    /// Hold these at their values, as [estimate] fixed of a rig file does: cameras.*.intrinsics, robot.joints.j6.d; may be given more than once
    #[arg(long, value_name = "PATH", value_delimiter = ',', conflicts_with = "relearn")]
    hold: Vec<String>,
    /// The side of all tags whose corners are features, and its standard deviation [m] [default: 0.0005]
    #[arg(long, value_name = "METRES[,SD]", value_parser = metres)]
    tag_side: Option<[f64; 2]>,
    /// Seed of every random choice: the same seed gives the same rig
    #[arg(long, value_name = "S", default_value_t = Options::default().seed)]
    seed: u64,
    /// Also write a page to read: residuals, coverage, worst samples, weak directions, a view that can be turned
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Threads to work on; the result does not depend on it [default: as many as there are cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Cameras that the rig does not list are on the hand, and what they see stands in the world; without it they stand in the world
    #[arg(long)]
    eye_in_hand: bool,
    #[command(flatten)]
    reading: Reading,
}

/// `f0,f7=0.12`, `cameras.left,cameras.right=0.3,0.001`
fn read_length(text: &str) -> Result<Length, String> {
    let expected = || "expected A,B=METRES[,SD], as f0,f7=0.12 or cameras.left,cameras.right=0.3".to_owned();
    let (between, length) = text.split_once('=').ok_or_else(expected)?;
    let (one, other) = between.split_once(',').ok_or_else(expected)?;
    let is_path = |end: &str| end.starts_with("features.") || end.starts_with("cameras.");
    let [one, other] = [one, other].map(|end| if is_path(end) { end.to_owned() } else { format!("features.{end}") });
    let [length, sd] = metres(length)?;
    Ok(Length { between: Ends::new([&one, &other]).map_err(|_| expected())?, length, sd })
}

/// A length, and its standard deviation where one is given.
fn metres(text: &str) -> Result<[f64; 2], String> {
    let (length, sd) = text.split_once(',').map_or((text, None), |(length, sd)| (length, Some(sd)));
    let number = |text: &str| text.parse::<f64>().ok().filter(|metres| *metres > 0.0 && metres.is_finite());
    let sd = sd.map_or(Some(Length::RULER), number);
    number(length).zip(sd).map(Into::into).ok_or_else(|| "expected lengths above 0, in metres".to_owned())
}

impl Calibrate {
    pub fn run(&self, is_json: bool, typed: &str) -> Result<Answer, Error> {
        let input = self.rig.as_deref().map(read_rig).transpose()?;
        let (recording, mut notes) = read_and_remark(&self.recordings, input.as_ref(), &self.reading, &self.relearn)?;
        let is_any_robot = input.as_ref().is_none_or(|input| input.rig.robot.joints.is_empty());
        if let Some(note) = is_any_robot.then(|| unsaid::still_joints(&recording)).flatten() {
            remark(&note);
            notes.push(note);
        }
        let mut inputs = files_read(&self.recordings, self.rig.as_deref(), &self.reading);
        check_output(&self.output, &inputs)?;
        if let Some(page) = &self.report {
            // Where the rig is learned into its own file, that is another output.
            inputs.extend(self.rig.iter().filter(|rig| !is_same(rig, &self.output)).cloned());
            check_output(page, &inputs)?;
            if is_same(page, &self.output) {
                return Err(Error::Unusable(format!("{}: given for two outputs", page.display())));
            }
        }
        let (mut rig, text) = input.map_or_else(|| (Rig::default(), None), |input| (input.rig, Some(input.text)));
        let places_cameras = !rig.cameras.is_empty() || self.eye_in_hand;
        if self.eye_in_hand {
            eye_in_hand(&mut rig, &recording)?;
        }
        for pattern in &self.hold {
            hold(&mut rig, &recording, pattern).map_err(|error| Error::Unusable(format!("--hold {error}")))?;
        }
        self.length.iter().for_each(|length| rig.estimate.measure(length.clone()));
        rig.estimate.tag_side = self.tag_side.or(rig.estimate.tag_side);
        let (estimate_noise, influence) = (self.estimate_noise, self.influence);
        let options = Options { seed: self.seed, estimate_noise, influence, ..Options::default() };
        let bar = Bar::new(is_json);
        let (trials, folds, calibration, suggestion, seconds) = on_threads(self.threads, || {
            let mut trials = Vec::new();
            if self.select_noise {
                trials = select_noise(&rig, &recording, &options, &mut |progress| bar.show("", progress))?;
                rig.noise = NoiseTrial::best(&trials).map_or(rig.noise, |best| best.noise);
            }
            let folds = self.folds.map(|n| Folds::new(&rig, &recording, n as usize, &options, &bar)).transpose()?;
            let start = std::time::Instant::now();
            let mut show = |progress: &Progress<'_>| bar.show("", progress);
            let calibration = if self.relearn.is_empty() {
                calibrate(&rig, &recording, &options, &mut show)?
            } else {
                relearn(&rig, &recording, &self.relearn, &options, &mut show)?
            };
            let seconds = start.elapsed().as_secs_f64();
            let next = || report::suggestion(&calibration.rig, &recording, &rig);
            let suggestion = self.report.as_ref().and_then(|_| next());
            Ok((trials, folds, calibration, suggestion, seconds))
        })?;
        drop(bar);
        let output = self.output.display();
        let Calibration { rig: learned, report } = &calibration;
        let mut answer =
            Answer::new(describe(&rig, &recording, &calibration, seconds), report_json(report, &recording));
        answer.json["seconds"] = json!(seconds);
        answer.json["camera_poses"] = camera_poses(&calibration).iter().map(camera_pose_json).collect();
        let lenses = lenses_against_given(&rig, &recording, &calibration);
        answer.json["lenses_against_given"] = lenses.iter().map(lens_json).collect();
        answer.json["noise_overstated"] = overstated_noise(&calibration).iter().map(overstated_json).collect();
        answer.json["notes"] = json!(notes);
        if !trials.is_empty() {
            answer.text += &format!("\n{}", noise::trials_table(&trials));
            answer.json["noise_trials"] = noise::trials_json(&trials);
        }
        if let Some(folds) = &folds {
            answer.text += &format!("\n{}", folds.text());
            answer.json["held_out"] = folds.json();
        }
        if report.converged {
            learned.write(&self.output, text.as_deref())?;
            answer.json["learned"] = json!(output.to_string());
            let is_lag = |finding: &Finding| matches!(finding, Finding::Lag { .. });
            answer.text += &match report.targets {
                None if report.findings.iter().any(is_lag) => {
                    "\nnext: mend the clocks, as the first line of what does not fit says, and calibrate again\n".to_owned()
                }
                None => format!("\nnext: handeye evaluate {output} FRESH.jsonl judges it on samples it has not seen\n"),
                Some(_) => "\nnext: learn from a second recording too: the poses of both agree within a few of their standard deviations\n".into(),
            };
        } else {
            let reason = "no minimum was reached, so what was learned is not to be relied on";
            answer.failure = Some(format!(
                "{output} was not written: {reason}; more varied motions, or a rig that gives more, would do"
            ));
        }
        let hints = unsaid::hints(&recording, report, is_any_robot, places_cameras);
        for hint in &hints {
            match &mut answer.failure {
                Some(failure) => *failure += &format!("; {hint}"),
                None => answer.text += &format!("\n{hint}\n"),
            }
        }
        answer.json["hints"] = json!(hints);
        if let Some(path) = &self.report {
            let title = format!("{}, learned from {}", file_name(&self.output), file_names(&self.recordings));
            let tables = folds.iter().map(Folds::as_table).collect::<Vec<_>>();
            let subject = report::Subject {
                about: report::About { title: &title, command: typed, notes: &notes },
                before: &rig,
                calibration: &calibration,
                recording: &recording,
                suggestion: suggestion.as_ref(),
                tables: &tables,
            };
            // What was learned is there whatever becomes of its page.
            if let Err(error) = report::html(&subject).and_then(|page| write_output(path, &page)) {
                let reason = format!("the page {} was not written: {error}", path.display());
                answer.failure.get_or_insert(reason);
            }
        }
        Ok(answer)
    }
}

/// Runs on a pool of that many threads, or on that of the whole process.
fn on_threads<T: Send>(threads: Option<u16>, work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
    let Some(threads) = threads else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build();
    pool.map_err(|error| Error::Unusable(format!("--threads {threads}: {error}")))?.install(work)
}

fn describe(before: &Rig, recording: &Recording, calibration: &Calibration, seconds: f64) -> String {
    let Calibration { rig: learned_rig, report } = calibration;
    let (samples, detections) = (count(report.samples, "sample"), count(report.observations, "detection"));
    let learned = learned_in_words(before, learned_rig);
    let mut text = format!("{learned} from {samples} with {detections}, in {}\n\n", duration(seconds));
    match &report.targets {
        Some(targets) => text += &targets_in_words(targets, report.rejected),
        None => text += &error_table(&report.cameras, &together(report), report.rejected).to_string(),
    }
    for overstated in overstated_noise(calibration) {
        text += &format!("\n{overstated}\n");
    }
    let cameras = camera_poses_in_words(calibration);
    if !cameras.is_empty() {
        text += &format!("\n{}\n", cameras.join("\n"));
    }
    for line in lenses_in_words(before, recording, calibration) {
        text += &format!("\n{line}\n");
    }
    if let Some(noise) = &report.noise {
        text += &format!("\nthe noise, estimated from the data: {}\n", noise::in_words(noise, recorded(report)));
    }
    if let Some(tip) = &report.tip {
        text += &format!("\nthe tip's position is known to {tip}\n");
        let assumed = if tip.hangs_on_priors() { assumptions(before, recording) } else { Vec::new() };
        if !assumed.is_empty() {
            text += &format!(
                "  what was assumed: {}; what is known better is held (`--hold 'cameras.*.intrinsics'`) or told (`[estimate.prior]` of a rig file)\n",
                assumed.join(", ")
            );
        }
    }
    for (title, lines) in [
        ("what is known of the robot's state", report.states.clone()),
        ("what the data leave open, and how it was fixed", report.gauge.clone()),
        ("what does not fit", findings_in_words(&report.findings, true)),
    ] {
        if !lines.is_empty() {
            text += &format!("\n{title}:\n");
            lines.iter().for_each(|line| text += &format!("  {line}\n"));
        }
    }
    text + &trust::text(report, recording)
}

/// What errors of each kind account for.
fn sources_json(sources: &Sources) -> Value {
    let Sources { data, robot, cameras, features, lengths } = sources;
    json!({ "data": data, "robot": robot, "cameras": cameras, "features": features, "lengths": lengths })
}

fn camera_pose_json(pose: &CameraPose) -> Value {
    json!({
        "camera": pose.camera,
        "on": pose.on,
        "xyz": pose.xyz,
        "rotation_vector": pose.turn,
        "sd": pose.sd,
        "sources": pose.sources.as_ref().map(sources_json),
        "assumed": pose.assumed,
        "sd_with_assumed": pose.sd_with_assumed,
        "metric": pose.metric,
        "text": pose.to_string(),
    })
}

fn lens_json(lens: &LensNumber) -> Value {
    let LensNumber { camera, number, given, learned, deviations } = lens;
    json!({ "camera": camera, "number": number, "given": given, "learned": learned, "deviations": deviations, "text": lens.to_string() })
}

fn overstated_json(noise: &OverstatedNoise) -> Value {
    let json = json!({ "factor": noise.factor, "text": noise.to_string() });
    with(with(json, "stated", &noise.stated), "shown", &noise.shown)
}

fn targets_in_words(targets: &TargetReport, rejected: usize) -> String {
    let (mm, deg) = (1e3 * targets.rms_xyz, targets.rms_rot.to_degrees());
    let mut text = format!("targets fit to {mm:.3} mm and {deg:.4}° rms per axis; {rejected} left out\n");
    targets.remarks().iter().for_each(|remark| text += &format!("{remark}\n"));
    text
}

fn targets_json(targets: &TargetReport) -> Value {
    let pair = |pair: Option<(f64, f64)>| pair.map(|(value, sd)| json!({ "value": value, "sd": sd }));
    let one = |one: &handeye::calibrate::Disagreement| json!({ "name": one.name, "rot": one.rot, "xyz": one.xyz });
    json!({
        "rms_xyz": targets.rms_xyz,
        "rms_rot": targets.rms_rot,
        "time_offset": pair(targets.time_offset),
        "scale": pair(targets.scale),
        "disagreements": targets.disagreements.iter().map(one).collect::<Vec<_>>(),
        "pixels_unused": targets.pixels_unused,
    })
}

/// Whether there are pixels, and points.
fn recorded(report: &Report) -> (bool, bool) {
    (report.observations > report.points.observations, report.points.observations > 0)
}

fn together(report: &Report) -> Errors {
    let largest = report.cameras.iter().map(|camera| camera.errors.max_px).fold(0.0, f64::max);
    Errors {
        observations: report.observations,
        rms_px: report.rms_px,
        mean_px: report.mean_px,
        median_px: report.median_px,
        max_px: largest,
        behind: report.cameras.iter().map(|camera| camera.errors.behind).sum(),
        points: report.points,
    }
}

/// How a rig was learned, as the one object of `--json`.
pub fn report_json(report: &Report, recording: &Recording) -> Value {
    let stage = |stage: &handeye::calibrate::StageReport| {
        json!({
            "name": stage.name,
            "iterations": stage.iterations,
            "loss_before": stage.loss_before,
            "loss_after": stage.loss_after,
            "seconds": stage.seconds,
        })
    };
    let metric = report.tip.filter(|tip| tip.metric);
    json!({
        "samples": report.samples,
        "observations": report.observations,
        "rejected": report.rejected,
        "rms_px": report.rms_px,
        "mean_px": report.mean_px,
        "median_px": report.median_px,
        "points": points_json(&report.points),
        "cameras": cameras_json(&report.cameras),
        "stages": report.stages.iter().map(stage).collect::<Vec<_>>(),
        "converged": report.converged,
        "gauge": report.gauge,
        "states": report.states,
        "noise": report.noise.as_ref().map(noise::json),
        "findings": report.findings.iter().map(|one| finding_json(one, one.to_string())).collect::<Vec<_>>(),
        "tip_sd": report.tip.map(|tip| json!({
            "median": tip.median, "largest": tip.largest, "by_data": tip.by_data, "metric": tip.metric,
            "sources": sources_json(&tip.sources),
        })),
        "targets": report.targets.as_ref().map(targets_json),
        "tip_sd_mm": metric.map(|tip| 1e3 * tip.median),
        "tip_sd_largest_mm": metric.map(|tip| 1e3 * tip.largest),
        "tip_sd_by_data_mm": metric.map(|tip| 1e3 * tip.by_data),
        "weak": report.weak.iter().map(trust::weak_json).collect::<Vec<_>>(),
        "influence": trust::influence_json(&report.influence, recording),
    })
}

/// Adds a distance as NAME_px or NAME_mm.
pub fn with(mut json: Value, name: &str, distance: &Distance) -> Value {
    match distance {
        Distance::Pixels(px) => json[format!("{name}_px")] = json!(px),
        Distance::Metres(m) => json[format!("{name}_mm")] = json!(1e3 * m),
    }
    json
}

/// A finding, with words for it.
pub fn finding_json(finding: &Finding, words: String) -> Value {
    let mut json = match finding {
        Finding::UnseenCamera { camera } => json!({ "kind": "unseen_camera", "camera": camera }),
        Finding::Misfit { ratio, stated } => with(json!({ "kind": "misfit", "ratio": ratio }), "stated", stated),
        Finding::Lag { seconds, misfits: [with_it, without] } => {
            let lag = with(json!({ "kind": "lag", "joints_late_s": seconds }), "fastest", with_it);
            with(lag, "fastest_without", without)
        }
        Finding::FarFromGiven { values } => {
            let value = |(path, [given, learned], sds): &(String, [f64; 2], f64)| json!({ "path": path, "given": given, "learned": learned, "deviations": sds });
            json!({ "kind": "far_from_given", "values": values.iter().map(value).collect::<Vec<_>>() })
        }
        Finding::MissedLength { length, learned } => {
            let (kind, names) = length.between.parts();
            let ends = names.each_ref().map(|name| format!("{kind}.{name}"));
            json!({ "kind": "missed_length", "between": ends, "length": length.length, "sd": length.sd, "learned": learned })
        }
        Finding::Outliers { count, of } => json!({ "kind": "outliers", "count": count, "of": of }),
        Finding::WrongJoints { sample, off, swapped_with, by_pose } => {
            let read = if *by_pose { "pose" } else { "joints" };
            let json = json!({ "kind": "wrong_joints", "read": read, "sample": sample, "swapped_with": swapped_with });
            with(json, "median", off)
        }
        Finding::UnknownState { sample } => json!({ "kind": "unknown_state", "sample": sample }),
        Finding::WrongImage { sample, camera, off } => {
            with(json!({ "kind": "wrong_image", "sample": sample, "camera": camera }), "median", off)
        }
        Finding::CameraMoved { camera, largest, sample } => {
            with(json!({ "kind": "camera_moved", "camera": camera, "sample": sample }), "largest", largest)
        }
    };
    json["text"] = json!(words);
    json
}
