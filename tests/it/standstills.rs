//! A robot that pauses at its positions while all is recorded: one sample a pause, and clocks that are apart.
use crate::bag::{bag, read_with};
use crate::cli::Folder;
use handeye::calibrate::{Finding as Unfit, Options, calibrate, evaluate};
use handeye::doctor::{Finding, examine};
use handeye::recording::{Detection, OpenOptions, Recording, Sample};
use handeye::report::evaluation_steps;
use handeye::rig::{Model, Rig};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::ops::ControlFlow;

/// A pause and a motion after it [s], and images a second.
const PAUSE: f64 = 1.2;
const MOTION: f64 = 1.4;
const RATE: f64 = 15.0;

/// Where an arm is at a time that goes from stop to stop, smooth in speed and acceleration.
fn at(stops: &[Vec<f64>], time: f64) -> Vec<f64> {
    let index = ((time.max(0.0) / (PAUSE + MOTION)) as usize).min(stops.len() - 2);
    let share = ((time - (PAUSE + MOTION) * index as f64 - PAUSE) / MOTION).clamp(0.0, 1.0);
    let share = share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share);
    stops[index].iter().zip(&stops[index + 1]).map(|(from, to)| from + share * (to - from)).collect()
}

/// A rig, its stops, and what was recorded from the first of them to the last, with images that show where the arm was `delay` [s] before their
/// stamps, and noise of the readings [rad].
fn paused(n_stops: usize, delay: f64, noise: f64, seed: u64) -> (Rig, Vec<Vec<f64>>, Recording) {
    let rig = random_rig(6, 2, 12, seed);
    let options = SimulateOptions { samples: n_stops, seed, ..SimulateOptions::default() };
    let mut recording = simulate(&rig, &options).unwrap().recording;
    let stops: Vec<Vec<f64>> = recording.samples.iter().flat_map(|sample| sample.joints.clone()).collect();
    let model = Model::new(&rig).unwrap();
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || -> f64 { StandardNormal.sample(random) };
    let features: Vec<usize> =
        recording.features.iter().map(|name| rig.features.iter().position(|f| f.name == *name).unwrap()).collect();
    let seconds = (PAUSE + MOTION) * n_stops as f64 - MOTION;
    recording.samples.clear();
    for index in 0..(seconds * RATE) as usize {
        let time = index as f64 / RATE;
        let links = model.links(&at(&stops, time - delay));
        let mut pixels = Vec::new();
        for (camera, size) in recording.cameras.iter().map(|camera| camera.size.unwrap()).enumerate() {
            for (feature, known) in features.iter().enumerate() {
                let pixel = model.pixel(camera, *known, &links).map(|x| x + 0.3 * normal());
                if (0.0..f64::from(size[0])).contains(&pixel[0]) && (0.0..f64::from(size[1])).contains(&pixel[1]) {
                    pixels.push(Detection { camera: camera as u32, feature: feature as u32, pixel });
                }
            }
        }
        let joints = at(&stops, time).into_iter().map(|joint| joint + noise * normal()).collect();
        recording.samples.push(Sample { time: Some(time), joints: Some(joints), pixels, ..Sample::default() });
    }
    (rig, stops, recording)
}

/// How far the joints of two moments are apart [rad].
fn apart(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
}

#[test]
fn one_sample_of_each_standstill_is_taken_from_its_middle_and_none_of_a_motion() {
    for (seed, noise) in [(1, 0.0), (2, 1e-4), (3, 2e-4)] {
        let (_, stops, recording) = paused(20, 0.015, noise, seed);
        let still = recording.still().unwrap();
        assert_eq!(still.samples.len(), stops.len(), "seed {seed}");
        for (index, (sample, stop)) in still.samples.iter().zip(&stops).enumerate() {
            let since = sample.time.unwrap() - (PAUSE + MOTION) * index as f64;
            assert!((0.15..PAUSE - 0.1).contains(&since), "seed {seed}, stop {index}: after {since} s");
            assert!(apart(sample.joints.as_ref().unwrap(), stop) <= 5.0 * noise, "seed {seed}, stop {index}");
        }
    }
}

/// By tip poses where there are no joints, and the sample that shows most.
#[test]
fn standstills_of_tip_poses_are_known_too_and_give_the_sample_that_shows_most() {
    let (rig, stops, mut recording) = paused(8, 0.0, 0.0, 4);
    let model = Model::new(&rig).unwrap();
    let tips: Vec<Pose> = stops.iter().map(|stop| model.tip(stop)).collect();
    recording.joints.clear();
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        sample.pose = Some(model.tip(&sample.joints.take().unwrap()));
        sample.pixels.truncate(if index % 39 == 10 { 12 } else { 3 });
    }
    let still = recording.still().unwrap();
    assert_eq!(still.samples.len(), tips.len());
    for (sample, tip) in still.samples.iter().zip(&tips) {
        assert!((sample.pose.unwrap().translation - tip.translation).norm() < 1e-9);
        assert!(sample.pixels.len() > 3, "{:?}", sample.time);
    }
}

#[test]
fn where_there_is_no_standstill_or_no_time_an_error_says_so() {
    let (_, stops, mut recording) = paused(6, 0.0, 0.0, 5);
    recording.samples.retain(|sample| stops.iter().all(|stop| apart(sample.joints.as_ref().unwrap(), stop) > 0.05));
    let problem = recording.still().unwrap_err();
    assert!(problem.contains("there is no standstill"), "{problem}");
    recording.samples.iter_mut().for_each(|sample| sample.time = None);
    let problem = recording.still().unwrap_err();
    assert!(problem.contains("no sample has a time"), "{problem}");
}

/// A recording of pauses is told of once, and not where one sample of each is taken, nor where each position has one sample.
#[test]
fn pauses_are_told_of_where_they_are_and_were_not_asked_for() {
    let folder = Folder::new("standstills");
    let (_, stops, recording) = paused(12, 0.0, 0.0, 6);
    let path = folder.path().join("paused.jsonl");
    recording.write(&path).unwrap();
    let n = recording.samples.len();
    let (out, err) = folder.expect(0, "convert paused.jsonl -o all.jsonl");
    assert_eq!((out + &err).matches("the robot pauses 12 times: --still takes one sample of each").count(), 1);
    let (out, err) = folder.expect(0, "convert paused.jsonl --still -o still.jsonl");
    let told = out + &err;
    assert!(told.contains(&format!("one sample of each standstill is taken: 12 of {n}")), "{told}");
    assert!(!told.contains("pauses"), "{told}");
    let still = Recording::read(&folder.path().join("still.jsonl")).unwrap();
    assert_eq!(still.samples.len(), stops.len());
    let (out, err) = folder.expect(2, "convert still.jsonl --still -o again.jsonl");
    assert!((out + &err).contains("there is no standstill"));
    let opened = Recording::open_with(&folder.path().join("still.jsonl"), &OpenOptions::default()).unwrap();
    assert_eq!(opened.notes, Vec::<String>::new());
}

/// Of the whole recording the moving images, whose clock is 50 ms off, spoil the rig; of its standstills none does.
#[test]
fn a_rig_of_standstills_does_not_feel_a_clock_that_is_off() {
    let (_, _, recording) = paused(24, 0.05, 0.0, 7);
    let still = recording.still().unwrap();
    let learned = calibrate(&Rig::default(), &still, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
    let rms = learned.rig.fit.unwrap().rms_px;
    assert!((0.2..0.6).contains(&rms), "noise of 0.3 px along each axis leaves {rms} px");
}

fn findings(recording: &Recording) -> Vec<Finding> {
    examine(&Rig::default(), recording, &Options::default()).findings
}

/// Where most images show an arm that stands still, the median hides a lag of 15 ms: by those of motions it is found, and none in clean data.
#[test]
fn a_lag_that_the_median_hides_is_found_and_named_with_its_cure_and_repeats_lead_to_standstills() {
    for seed in 1..=3 {
        for delay in [0.0, 0.015] {
            let (_, _, recording) = paused(24, delay, 0.0, seed);
            let diagnosis = examine(&Rig::default(), &recording, &Options::default());
            assert!(diagnosis.thinned_to.is_some_and(|n| (100..150).contains(&n)), "{:?}", diagnosis.thinned_to);
            let (lags, others): (Vec<Finding>, Vec<Finding>) =
                diagnosis.findings.into_iter().partition(|finding| finding.what.contains("stamped"));
            assert!(others.len() == 1 && others[0].what.contains("repeat the robot's state"), "{others:?}");
            assert!(others[0].change.ends_with("each of the 24 pauses of the robot: --still does"), "{others:?}");
            if delay == 0.0 {
                assert!(lags.is_empty(), "seed {seed}: {lags:?}");
                continue;
            }
            let [lag] = &lags[..] else { panic!("seed {seed}: {lags:?}, {:?}", diagnosis.scores) };
            let named = lag.change.split("--joint-delay ").nth(1).unwrap().split('`').next().unwrap();
            let named: f64 = named.parse().unwrap();
            assert!(lag.what.ends_with("s too early") && lag.change.contains("--joint-delay"), "{lag:?}");
            assert!((named - delay).abs() <= 0.002, "seed {seed}: {lag:?}");
        }
    }
    let (_, _, recording) = paused(24, 0.015, 0.0, 4);
    assert_eq!(findings(&recording.still().unwrap()), Vec::new(), "standstills do not show a lag");
}

/// Whoever does not check first is told of it by what is left out, and no camera is said to have moved; where one did, no lag is named.
#[test]
fn a_lag_behind_what_does_not_fit_is_named_by_learning_and_by_judging() {
    let lag = |findings: &[Unfit]| match findings {
        [Unfit::Lag { seconds, .. }, ..] => Some(*seconds),
        _ => None,
    };
    for seed in 1..=3 {
        let (rig, _, late) = paused(24, 0.05, 0.0, seed);
        let (_, _, clean) = paused(24, 0.0, 0.0, seed);
        let learn = |recording: &Recording| {
            calibrate(&Rig::default(), recording, &Options::default(), &mut |_| ControlFlow::Continue(()))
                .unwrap()
                .report
        };
        let found = learn(&late).findings;
        assert!(lag(&found).is_some_and(|seconds| (seconds + 0.05).abs() < 0.005), "seed {seed}: {found:?}");
        assert_eq!(lag(&learn(&clean).findings), None, "seed {seed}");

        let judged = evaluate(&rig, &late).unwrap();
        let found = &judged.fitting.findings;
        assert!(lag(found).is_some_and(|seconds| (seconds + 0.05).abs() < 0.005), "seed {seed}: {found:?}");
        let steps = evaluation_steps(&rig, &judged);
        assert!(
            steps.len() == 1 && steps[0].contains("stamped 0.05") && steps[0].contains("--joint-delay"),
            "{steps:?}"
        );
        let mut moved = rig.clone();
        moved.cameras[0].pose.as_mut().unwrap().translation.x += 0.05;
        let judged = evaluate(&moved, &clean).unwrap();
        assert!(judged.total.rms_px > 5.0 && !judged.misfits.is_empty(), "seed {seed}: {} px", judged.total.rms_px);
        assert_eq!(lag(&judged.fitting.findings), None, "seed {seed}");
    }
}

/// What the check finds is what mends the bag: the joints of a moment are those stamped so much earlier.
#[test]
fn joints_of_a_bag_are_delayed_by_what_is_asked_for() {
    let folder = Folder::new("joint-delay");
    let (_, stops, mut recording) = paused(4, 0.0, 0.0, 8);
    recording.features = (0..12).map(|k| format!("tag36h11:{}/{}", k / 4, k % 4)).collect();
    recording.samples.iter_mut().for_each(|sample| sample.pixels.retain(|seen| seen.feature < 4));
    let bytes = bag(&recording, mcap::WriteOptions::new(), false);
    let read = |joint_delay: Option<f64>| {
        let known_joints = recording.joints.clone();
        let options = OpenOptions { joint_delay, known_joints, ..OpenOptions::default() };
        read_with(&bytes, &folder, &options).unwrap().recording.samples
    };
    let as_recorded = read(None);
    assert!(stops.len() == 4 && as_recorded.len() > 20);
    for (delay, samples) in [0.03, -0.03].map(|delay| (delay, read(Some(delay)))) {
        for (index, sample) in samples.iter().enumerate() {
            // Images are 0.1 s apart, and joints are stamped as they are.
            let other = if delay > 0.0 { index.checked_sub(1) } else { Some(index + 1) };
            let other = other.and_then(|other| as_recorded.get(other));
            let is_whole = other.is_some_and(|other| (other.time.unwrap() - sample.time.unwrap()).abs() < 0.11);
            let Some(joints) = &sample.joints else { continue };
            if !is_whole {
                continue;
            }
            let [here, there] = [&as_recorded[index], other.unwrap()].map(|sample| sample.joints.as_ref().unwrap());
            let expected: Vec<f64> = here.iter().zip(there).map(|(here, there)| here + 0.3 * (there - here)).collect();
            assert!(apart(joints, &expected) < 1e-6, "{delay}, sample {index}");
        }
    }
}

/// What is on file can be stamped anew too, where samples are dense; between them joints are known to a fraction of a milliradian.
#[test]
fn joints_of_a_recording_are_delayed_by_what_is_asked_for_where_samples_are_dense() {
    let folder = Folder::new("joint-delay-file");
    for (seed, delay) in [(1, 0.05), (2, -0.04), (3, 0.02)] {
        let (_, stops, recording) = paused(12, delay, 0.0, seed);
        recording.write(&folder.path().join("late.jsonl")).unwrap();
        let (out, err) = folder.expect(0, &format!("convert late.jsonl --joint-delay {delay} -o mended.jsonl"));
        assert!((out + &err).contains(&format!("are stamped {delay} s later")));
        let mended = Recording::read(&folder.path().join("mended.jsonl")).unwrap();
        let lost = recording.samples.len() - mended.samples.len();
        assert!(lost <= 1, "seed {seed}: {lost} samples lost");
        for sample in &mended.samples {
            let off = apart(sample.joints.as_ref().unwrap(), &at(&stops, sample.time.unwrap() - delay));
            assert!(off < 5e-4, "seed {seed}, {:?}: {off} rad", sample.time);
        }
    }
    let (_, _, recording) = paused(12, 0.0, 0.0, 4);
    recording.still().unwrap().write(&folder.path().join("still.jsonl")).unwrap();
    let (out, err) = folder.expect(2, "convert still.jsonl --joint-delay 0.05 -o again.jsonl");
    assert!((out + &err).contains("still.jsonl: --joint-delay: samples have no times, or the robot moves too far"));
}
