//! Joint positions that are suggested are worth more than random ones, and buy what is said.
use crate::cli::Folder;
use crate::learning::{learn, nothing, record, variants};
use handeye::Error;
use handeye::calibrate::{Calibration, SuggestOptions, Suggestion, suggest};
use handeye::chain::JointKind;
use handeye::recording::{Detection, Recording};
use handeye::rig::{Limits, Model, Rig};
use handeye::simulate::random_rig;
use nalgebra::Vector3;
use serde_json::Value;
use std::f64::consts::{PI, TAU};
use visits::{gauge_alone, in_view, tip_error, visit};

#[path = "../../benches/common/visits.rs"]
mod visits;

const SEEDS: u64 = 20;

fn ask(learned: &Rig, recording: Option<&Recording>, known: Option<&Rig>, count: usize) -> Result<Suggestion, Error> {
    suggest(learned, recording, known, &SuggestOptions { count, ..SuggestOptions::default() })
}

fn tip(calibration: &Calibration) -> f64 {
    calibration.report.tip.unwrap().by_data
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Against the truth: ten random samples, and five more, suggested or random.
#[test]
fn five_suggested_positions_bring_the_tip_nearer_to_the_truth_than_five_random_ones() {
    let (mut ratios, mut said) = (Vec::new(), Vec::new());
    for seed in 1..=SEEDS {
        let truth = random_rig(6, 2, 12, seed);
        let (start, ten) = (gauge_alone(&truth), record(&truth, 10, seed));
        let learned = learn(&start, &ten).unwrap().rig;
        let found = ask(&learned, Some(&ten), Some(&start), 5).unwrap();
        let with_suggested = learn(&start, &visit(&truth, &ten, &found, seed)).unwrap();
        let with_random = learn(&start, &record(&truth, 15, seed)).unwrap();
        let [suggested, random] = [&with_suggested, &with_random].map(|one| tip_error(&one.rig, &truth, seed));
        println!(
            "{seed}: now {:.3} mm, suggested {:.3} mm, random {:.3} mm; {:.3} mm said",
            1e3 * tip_error(&learned, &truth, seed),
            1e3 * suggested,
            1e3 * random,
            1e3 * found.samples[4].tip
        );
        ratios.push(suggested / random);
        said.push((suggested / found.samples[4].tip).powi(2));
    }
    let (ratio, said) = (median(ratios), (said.iter().sum::<f64>() / said.len() as f64).sqrt());
    println!("suggested over random {ratio:.3}, true error over what is said {said:.3}");
    assert!(ratio < 0.8, "{ratio:.3} of the error with random ones in the median");
}

/// From nothing: what is expected of the suggested positions is what calibrate then reports, and more than of random ones.
#[test]
fn suggested_positions_buy_what_is_said() {
    let (mut bought, mut random_said, mut now) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 1..=SEEDS {
        let truth = random_rig(6, 2, 12, seed);
        let ten = record(&truth, 10, seed);
        let learned = learn(&nothing(&truth), &ten).unwrap();
        let found = ask(&learned.rig, Some(&ten), None, 5).unwrap();
        assert!(!found.metric && !found.stood_in && found.learned_from == 10);
        let fifteen = visit(&truth, &ten, &found, seed);
        let then = learn(&nothing(&truth), &fifteen).unwrap();
        let random = learn(&nothing(&truth), &record(&truth, 15, seed)).unwrap();
        // Over the same workspace, the deviation is that expected; over the recorded samples, nearly so.
        let again = ask(&then.rig, Some(&fifteen), None, 1).unwrap();
        let last = &found.samples[4];
        assert!(
            (again.now / last.tip - 1.0).abs() < 0.1,
            "seed {seed}: {:.2e} expected, {:.2e} then",
            last.tip,
            again.now
        );
        assert!(
            (tip(&then) / last.tip - 1.0).abs() < 0.25,
            "seed {seed}: {:.2e} expected, {:.2e} reported",
            last.tip,
            tip(&then)
        );
        assert!(found.samples.windows(2).all(|pair| pair[1].tip < pair[0].tip) && found.samples[0].tip < found.now);
        now.push(found.now / tip(&learned));
        random_said.push(tip(&random) / last.tip_random);
        bought.push(tip(&then) / tip(&random));
    }
    let [bought, random_said, now] = [bought, random_said, now].map(median);
    println!("suggested over random {bought:.3}; reported over expected: now {now:.3}, random {random_said:.3}");
    assert!(bought < 0.75, "{bought:.3} of the deviation with random ones in the median");
    assert!((now - 1.0).abs() < 0.1 && (random_said - 1.0).abs() < 0.15, "{now:.3} {random_said:.3}");
}

#[test]
fn without_the_recording_positions_are_ranked_nearly_as_well() {
    let (mut bought, mut said) = (Vec::new(), Vec::new());
    for seed in 1..=10 {
        let truth = random_rig(6, 2, 12, seed);
        let ten = record(&truth, 10, seed);
        let learned = learn(&nothing(&truth), &ten).unwrap();
        let found = ask(&learned.rig, None, None, 5).unwrap();
        assert!(found.stood_in);
        let then = learn(&nothing(&truth), &visit(&truth, &ten, &found, seed)).unwrap();
        let random = learn(&nothing(&truth), &record(&truth, 15, seed)).unwrap();
        bought.push(tip(&then) / tip(&random));
        said.push(tip(&then) / found.samples[4].tip);
    }
    let (bought, said) = (median(bought), median(said));
    println!("suggested without the recording over random {bought:.3}, reported over expected {said:.3}");
    assert!(bought < 0.9, "{bought:.3} of the deviation with random ones in the median");
    assert!((0.6..1.6).contains(&said), "{said:.3} of what is said");
}

/// Of which nothing is known but the kinds of the joints, their limits, and what is fixed to what.
fn limits_known(truth: &Rig) -> Rig {
    let mut rig = variants::forgotten(truth);
    rig.robot.joints = truth.robot.joints.clone();
    for joint in &mut rig.robot.joints {
        (joint.offset, joint.d, joint.a, joint.alpha, joint.beta) = (None, None, None, None, None);
    }
    rig
}

#[test]
fn every_kind_of_rig_gets_what_is_said_inside_its_limits_and_in_view() {
    let mut noisy = random_rig(6, 2, 12, 5);
    noisy.noise.joints = 0.003;
    let cases = [
        ("cameras on the hand", variants::on_hand(2, 5), 20),
        ("a sliding joint", variants::prismatic(5), 20),
        ("modified DH", variants::modified(5), 20),
        ("features on links", variants::on_links(5), 20),
        ("parallel axes", variants::ur5(5), 20),
        ("noisy joints", noisy, 25),
    ];
    for (name, truth, samples) in cases {
        for (start, known) in [(limits_known(&truth), false), (variants::nominal(&truth), true)] {
            let before = record(&truth, samples, 5);
            let learned = learn(&start, &before).unwrap().rig;
            let found = ask(&learned, Some(&before), known.then_some(&start), 4).unwrap();
            let model = Model::new(&learned).unwrap();
            for sample in &found.samples {
                for (value, joint) in sample.joints.iter().zip(&truth.robot.joints) {
                    let (lower, upper) = (joint.limits.lower.unwrap(), joint.limits.upper.unwrap());
                    assert!((lower..=upper).contains(value), "{name}: {value} beyond {lower} to {upper}");
                }
                let seen = in_view(&model, &learned, &sample.joints);
                assert!((1..=seen.len()).contains(&sample.in_view), "{name}: {} of {}", sample.in_view, seen.len());
                let of_camera = |camera: usize| seen.iter().filter(|one| one.0 == camera).count();
                let most = (0..truth.cameras.len()).map(of_camera).max().unwrap();
                assert!(2 * most >= truth.features.len(), "{name}: {most} features in view");
            }
            let more = visit(&truth, &before, &found, 5);
            let then = learn(&start, &more).unwrap().rig;
            let then = ask(&then, Some(&more), known.then_some(&start), 1).unwrap().now;
            let [expected, random] = [found.samples[3].tip, found.samples[3].tip_random];
            println!(
                "{name}, {known}: now {:.2e}, expected {expected:.2e}, random {random:.2e}, then {then:.2e}",
                found.now
            );
            assert!((then / expected - 1.0).abs() < 0.2, "{name}: {expected:.2e} expected, {then:.2e} then");
            assert!(expected < random, "{name}: {expected:.2e} with suggested ones, {random:.2e} with random ones");
        }
    }
}

/// Features on the front of a board, which shows up to 70 degrees from its normal.
#[test]
fn nobody_is_sent_to_see_the_back_of_a_board() {
    let normal = Vector3::new(-0.3, 0.0, 1.0).normalize();
    let (mut hidden, mut tried) = (0, 0);
    for seed in 1..=8 {
        let truth = variants::planar(2, seed);
        let model = Model::new(&truth).unwrap();
        let shows = |joints: &[f64], camera: usize, feature: usize| {
            let centre = model.cameras[camera].pose.translation;
            let side = model.tip(joints).inverse_transform(&centre) - model.features[feature].xyz;
            side.normalize().dot(&normal) > 70_f64.to_radians().cos()
        };
        let mut recording = record(&truth, 60, seed);
        let names = recording.features.clone();
        let feature = |place: u32| truth.features.iter().position(|one| one.name == names[place as usize]).unwrap();
        for sample in &mut recording.samples {
            let joints = sample.joints.clone().unwrap();
            sample.pixels.retain(|seen| shows(&joints, seen.camera as usize, feature(seen.feature)));
        }
        // Where a board faces away nearly always, nothing is learned.
        let seen =
            |camera| recording.samples.iter().flat_map(|one| &one.pixels).filter(move |one| one.camera == camera);
        if (0..2).any(|camera| seen(camera).count() < 100) {
            continue;
        }
        tried += 1;
        let start = variants::nominal(&truth);
        let learned = learn(&start, &recording).unwrap().rig;
        let blind_to = |recording: Option<&Recording>| {
            let found = ask(&learned, recording, Some(&start), 5).unwrap();
            let sees_enough = |joints: &Vec<f64>| {
                let seen = in_view(&model, &truth, joints);
                let of_camera = |camera| {
                    let shown = seen.iter().filter(|one| one.0 == camera && shows(joints, camera, one.1));
                    // Half were expected; one or two may be at an edge of the image.
                    3 * shown.count() >= truth.features.len()
                };
                (0..truth.cameras.len()).any(of_camera)
            };
            found.samples.iter().filter(|sample| !sees_enough(&sample.joints)).count()
        };
        assert_eq!(blind_to(Some(&recording)), 0, "seed {seed}");
        hidden += blind_to(None);
    }
    assert!(hidden > 0 && tried >= 5, "the fixture hides nothing: {hidden} of {tried}");
}

#[test]
fn without_limits_joints_stay_where_they_were_while_the_rig_was_learned() {
    let truth = random_rig(6, 2, 12, 3);
    let recording = record(&truth, 20, 3);
    let learned = learn(&nothing(&truth), &recording).unwrap().rig;
    let ranges = &learned.fit.as_ref().unwrap().joints;
    for sample in ask(&learned, Some(&recording), None, 5).unwrap().samples {
        for (value, [least, most]) in sample.joints.iter().zip(ranges) {
            assert!((least..=most).contains(&value), "{value} outside {least} to {most}");
        }
    }
}

/// Where nothing is known of obstacles, a person knows the table, and where the arm has been before.
#[test]
fn positions_stay_above_the_table_and_near_where_the_arm_has_been() {
    let truth = variants::ur5(2);
    let arm = Rig { cameras: Vec::new(), features: Vec::new(), ..truth.clone() };
    let recording = record(&truth, 20, 2);
    let learned = learn(&arm, &recording).unwrap().rig;
    let model = Model::new(&learned).unwrap();
    let lowest = |joints: &[f64]| {
        let links = model.links(joints);
        let carried = model.features.iter().map(|feature| links[6].transform(&feature.xyz).z);
        links[2..].iter().map(|link| link.translation.z).chain(carried).fold(f64::INFINITY, f64::min)
    };
    let ask = |near, above| {
        let options = SuggestOptions { count: 4, near, above, ..SuggestOptions::default() };
        suggest(&learned, Some(&recording), Some(&arm), &options)
    };
    let outside = |suggestion: &Suggestion| {
        let ranges = &learned.fit.as_ref().unwrap().joints;
        let all = suggestion.samples.iter().flat_map(|sample| sample.joints.iter().zip(ranges));
        all.filter(|(value, [least, most])| {
            let more = 0.25 * (most - least) + 1e-9;
            !(least - more..=most + more).contains(*value)
        })
        .count()
    };
    let heights = |suggestion: &Suggestion| -> Vec<f64> {
        suggestion.samples.iter().map(|sample| lowest(&sample.joints)).collect()
    };
    let (free, held) = (ask(false, None).unwrap(), ask(true, Some(0.2)).unwrap());
    let lows = heights(&free);
    assert!(lows.iter().any(|low| *low < 0.2), "the fixture is never low: {lows:?}");
    assert!(heights(&held).iter().all(|low| *low >= 0.2 - 1e-9), "{:?}", heights(&held));
    assert_eq!(outside(&held), 0);
    let error = ask(false, Some(5.0)).unwrap_err().to_string();
    assert!(error.contains("nothing of the arm is below 5 m"), "{error}");
}

/// A UR5 turns each joint twice round; where it is sent, it need not unwind first.
#[test]
fn joints_are_not_sent_a_whole_turn_away() {
    let mut truth = variants::ur5(1);
    let recording = record(&truth, 20, 1);
    for joint in &mut truth.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-TAU), Some(TAU));
    }
    let learned = learn(&limits_known(&truth), &recording).unwrap().rig;
    let ranges = &learned.fit.as_ref().unwrap().joints;
    for sample in ask(&learned, Some(&recording), None, 4).unwrap().samples {
        for (value, [least, most]) in sample.joints.iter().zip(ranges) {
            assert!((value - 0.5 * (least + most)).abs() <= PI + 1e-9, "{value} beside {least} to {most}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_positions_on_any_number_of_threads() {
    let truth = random_rig(6, 2, 12, 4);
    let recording = record(&truth, 15, 4);
    let learned = learn(&nothing(&truth), &recording).unwrap().rig;
    let on = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            suggest(&learned, Some(&recording), None, &SuggestOptions { count: 3, seed, ..SuggestOptions::default() })
                .unwrap()
        })
    };
    assert_eq!(on(1, 7), on(3, 7));
    assert_ne!(on(1, 7).samples, on(1, 8).samples);
}

#[test]
fn what_cannot_be_weighed_is_refused_with_the_reason() {
    let truth = random_rig(6, 2, 12, 6);
    let recording = record(&truth, 15, 6);
    let learned = learn(&nothing(&truth), &recording).unwrap().rig;
    let told = |learned: &Rig, recording: &Recording, known: Option<&Rig>, count| {
        ask(learned, Some(recording), known, count).unwrap_err().to_string()
    };
    assert!(told(&learned, &recording, None, 0).contains("0 joint positions"));
    assert!(told(&truth, &recording, None, 3).contains("has no [fit]"));
    let started = learn(&truth, &recording).unwrap().rig;
    let unknown_start = told(&started, &recording, None, 3);
    assert!(unknown_start.contains("`robot.base` was free when the rig was learned"), "{unknown_start}");
    assert!(ask(&started, Some(&recording), Some(&truth), 1).is_ok());
    let mut chain_held = truth.clone();
    chain_held.estimate.fixed = vec!["robot".into()];
    let no_tip = told(&learn(&chain_held, &recording).unwrap().rig, &recording, Some(&chain_held), 3);
    assert!(no_tip.contains("the tip does not follow from anything that was learned"), "{no_tip}");
    let mut other = recording.clone();
    other.features[3] = "elsewhere".into();
    let other = told(&learned, &other, None, 3);
    assert!(other.contains("no feature `elsewhere`"), "{other}");
    let mut slides = variants::prismatic(6);
    let of_slides = record(&slides, 20, 6);
    slides = learn(&limits_known(&slides), &of_slides).unwrap().rig;
    slides.robot.joints[2].limits = Limits::default();
    slides.fit.as_mut().unwrap().joints.clear();
    let endless = told(&slides, &of_slides, None, 3);
    assert!(slides.robot.joints[2].kind == JointKind::Prismatic && endless.contains("`j3` is prismatic"), "{endless}");
}

#[test]
fn the_command_lists_positions_writes_them_for_the_robot_and_says_what_they_buy() {
    let folder = Folder::new("suggest");
    folder.expect(0, "simulate ur5 --samples 12 --seed 3 -o motions.jsonl");
    folder.expect(0, "calibrate motions.jsonl -o learned.toml");
    let (text, _) = folder.expect(0, "suggest learned.toml --count 2 --with motions.jsonl -o next.jsonl");
    for word in ["2 joint positions", "wrist_3", "°)", "in view", "as many random ones", "next.jsonl"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let to_visit = Recording::read(&folder.path().join("next.jsonl")).unwrap();
    assert_eq!((to_visit.samples.len(), to_visit.joints.len(), to_visit.cameras.len()), (2, 6, 2));
    // The robot goes there, and both recordings are one.
    let mut visited = to_visit.clone();
    let ur5 = handeye::rig::catalog::rig("ur5").unwrap();
    visited.features = ur5.features.iter().map(|feature| feature.name.clone()).collect();
    let model = Model::new(&ur5).unwrap();
    for sample in &mut visited.samples {
        for (camera, feature, pixel) in in_view(&model, &ur5, sample.joints.as_ref().unwrap()) {
            sample.pixels.push(Detection { camera: camera as u32, feature: feature as u32, pixel });
        }
    }
    visited.write(&folder.path().join("visited.jsonl")).unwrap();
    let (both, _) = folder.expect(0, "calibrate motions.jsonl visited.jsonl -o both.toml");
    assert!(both.contains("14 samples"), "{both}");
    let (json, _) = folder.expect(0, "suggest learned.toml --count 2 --with motions.jsonl --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    let joints: Vec<f64> =
        json["samples"][1]["joints"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert_eq!(Some(&joints), to_visit.samples[1].joints.as_ref());
    assert!(json["samples"][1]["tip_sd"].as_f64() < json["tip_sd"].as_f64() && json["stood_in"] == false);
    let (ranking, _) = folder.expect(0, "suggest learned.toml --count 1");
    assert!(ranking.contains("a ranking more than a prediction") && ranking.contains("--with"), "{ranking}");
    let (_, refused) = folder.expect(2, "suggest learned.toml --with motions.jsonl -o motions.jsonl");
    assert!(refused.contains("is an input too"), "{refused}");
}

#[test]
fn the_rig_that_calibration_started_from_is_asked_for_by_its_option() {
    let folder = Folder::new("suggest-start");
    folder.expect(0, "simulate ur5 --samples 12 --seed 3 -o motions.jsonl");
    folder.expect(0, "calibrate motions.jsonl --rig ur5 -o arm.toml");
    let (_, err) = folder.expect(2, "suggest arm.toml --with motions.jsonl");
    assert!(err.contains("give the rig that calibration started from, as `--rig RIG`"), "{err}");
    folder.expect(0, "suggest arm.toml --with motions.jsonl --rig ur5 --count 1");
    // What was held by an option is in the learned rig's file.
    folder.expect(
        0,
        "calibrate motions.jsonl --rig ur5 --hold cameras.*.intrinsics --hold robot.joints.elbow -o held.toml",
    );
    folder.expect(0, "suggest held.toml --with motions.jsonl --rig ur5 --count 1");
}
