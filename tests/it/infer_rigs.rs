//! What is inferred with rigs of every kind: few and many joints, sliding ones, cameras on the hand, features on any link; with
//! cameras and features missing, and with too few of them.
use crate::infer::{follows_chi_square, inference, record, wrap};
use crate::learning::variants;
use handeye::chain::JointKind;
use handeye::infer::{Branch, Moment, Names, Prior, Sighting, Sightings};
use handeye::rig::{Model, Rig, catalog};
use handeye::simulate::{SimulateOptions, Simulation, random_rig, simulate};
use handeye::solvers::manifold::so3;
use nalgebra::{DVector, Vector6};
use std::f64::consts::TAU;

/// Every revolute joint may turn by 2π to either side.
fn unlimited(mut rig: Rig) -> Rig {
    for joint in rig.robot.joints.iter_mut().filter(|joint| joint.kind == JointKind::Revolute) {
        (joint.limits.lower, joint.limits.upper) = (Some(-TAU), Some(TAU));
    }
    rig
}

/// Samples in which both cameras see all twelve features.
pub fn whole(rig: &Rig, samples: usize, seed: u64) -> Vec<(Vec<Sighting>, Vec<f64>)> {
    let mut all = record(rig, 2 * samples, seed);
    all.retain(|(seen, _)| seen.len() == 24);
    all.truncate(samples);
    assert_eq!(all.len(), samples);
    all
}

/// Difference of joints to the truth, whole turns apart being none.
fn error(rig: &Rig, branch: &Branch, truth: &[f64]) -> DVector<f64> {
    let difference = |((found, truth), joint): ((&f64, &f64), &handeye::rig::Joint)| match joint.kind {
        JointKind::Revolute => wrap(found - truth),
        JointKind::Prismatic => found - truth,
    };
    let all = branch.joints.iter().zip(truth).zip(&rig.robot.joints).map(difference);
    DVector::from_vec(all.collect())
}

/// Squared distance of the truth in standard deviations.
fn mahalanobis(rig: &Rig, branch: &Branch, truth: &[f64]) -> f64 {
    let error = error(rig, branch, truth);
    branch.covariance.clone().cholesky().unwrap().solve(&error).dot(&error)
}

/// The branch that the truth is on: the nearest, in standard deviations, and how far.
fn nearest(rig: &Rig, branches: &[Branch], truth: &[f64]) -> f64 {
    branches.iter().map(|branch| mahalanobis(rig, branch, truth)).fold(f64::INFINITY, f64::min)
}

/// Largest standard deviation of a joint [rad] with which errors are still Gaussian: the chain is linear that far.
const GAUSSIAN: f64 = 0.05;

#[test]
fn rigs_of_every_kind_have_the_truth_among_their_branches_and_inside_their_covariance() {
    type Make = fn(u64) -> Rig;
    let kinds: [(&str, Make); 10] = [
        ("four joints", |seed| random_rig(4, 2, 12, seed)),
        ("five joints", |seed| random_rig(5, 2, 12, seed)),
        ("six joints, one camera", |seed| random_rig(6, 1, 12, seed)),
        ("six joints", |seed| random_rig(6, 2, 12, seed)),
        ("a sliding joint", variants::prismatic),
        ("features on two links", variants::on_links),
        ("modified convention, plane target", |seed| variants::modified(seed)),
        ("features in a plane", |seed| variants::planar(2, seed)),
        ("camera on the hand", |seed| variants::on_hand(1, seed)),
        ("two cameras on the hand", |seed| variants::on_hand(2, seed)),
    ];
    for (name, make) in kinds {
        let (mut listed, mut vague, mut best, mut sum, mut freedom, mut open) = (0, 0, 0, 0.0, 0, 0);
        for seed in 1..=10 {
            let rig = make(seed);
            let mut inference = inference(&rig);
            for (seen, truth) in record(&rig, 10, seed) {
                let found = inference.joints(&seen, &Prior::none()).unwrap();
                let n = truth.len();
                let largest = found[0].covariance.diagonal().max().sqrt();
                if largest > GAUSSIAN {
                    // So close to a singularity the truth is somewhere along a bent valley, not inside an ellipsoid.
                    let near = inference.joints_near(&seen, &Prior::start(&truth)).unwrap();
                    let explained = found.iter().any(|branch| branch.rms_px < 1.05 * near.rms_px);
                    (listed, vague) = (listed + usize::from(explained), vague + 1);
                    continue;
                }
                // 1 in 10,000 is so far off by chance.
                let bound = n as f64 + 5.0 * (2.0 * n as f64).sqrt() + 5.0;
                let distance = nearest(&rig, &found, &truth);
                if distance < bound {
                    (listed, sum, freedom) = (listed + 1, sum + distance, freedom + n);
                    best += usize::from(mahalanobis(&rig, &found[0], &truth) < bound);
                }
                open += usize::from(!found[0].open.is_empty());
            }
        }
        assert!(listed >= 97, "{name}: {listed} of 100 are listed");
        // At a singular position and with half of the features in view of the only camera.
        assert!(open <= 2, "{name}: something is open in {open} of 100");
        assert!(vague <= 80, "{name}: {vague} of 100 are vague");
        assert!(10 * best >= 6 * (100 - vague), "{name}: {best} of {} are the most probable", 100 - vague);
        // What was cut off at the bound is less than 1 in 1,000.
        assert!(
            (sum / freedom as f64 - 1.0).abs() < 4.0 * (2.0 / freedom as f64).sqrt() + 0.01,
            "{name}: {sum} {freedom}"
        );
    }
}

#[test]
fn a_missing_camera_or_feature_widens_the_covariance_and_nothing_else() {
    let rig = catalog::rig("ur5").unwrap();
    let mut inference = inference(&rig);
    type Keep = fn(&Sighting) -> bool;
    let fewer: [(&str, Keep); 4] = [
        ("all", |_| true),
        ("one camera", |sighting| sighting.camera == 0),
        ("four features", |sighting| sighting.feature < 4),
        ("one camera, six features", |sighting| sighting.camera == 0 && sighting.feature % 2 == 0),
    ];
    let mut sums = [0.0; 4];
    for (seen, truth) in whole(&rig, 100, 8) {
        let mut sd: Vec<f64> = Vec::new();
        for (k, (what, keep)) in fewer.iter().enumerate() {
            let kept: Vec<Sighting> = seen.iter().filter(|sighting| keep(sighting)).copied().collect();
            // From the truth, so that it is the same branch.
            let branch = inference.joints_near(&kept, &Prior::start(&truth)).unwrap();
            assert!(branch.open.is_empty(), "{what}");
            sums[k] += mahalanobis(&rig, &branch, &truth);
            sd.push(branch.covariance.diagonal().map(f64::sqrt).sum());
        }
        assert!(sd[1..].iter().all(|fewer| *fewer > sd[0]) && sd[3] > sd[1], "{sd:?}");
    }
    // Few features before one camera bend the cost more than a Gaussian has it: a fifth more.
    follows_chi_square(sums[0], 600);
    assert!(sums[1..].iter().all(|sum| (480.0..720.0).contains(sum)), "{sums:?}");
}

#[test]
fn with_too_little_to_see_the_open_directions_are_named_and_the_joints_stay_near_the_prior_there() {
    let rig = catalog::rig("ur5").unwrap();
    let mut inference = inference(&rig);
    let cases: [(usize, usize, usize); 4] = [(1, 1, 4), (1, 2, 2), (2, 1, 3), (2, 2, 1)];
    for (seen, truth) in whole(&rig, 20, 9) {
        for (cameras, features, open) in cases {
            let is_kept = |sighting: &&Sighting| sighting.camera < cameras && sighting.feature < features;
            let kept: Vec<Sighting> = seen.iter().filter(is_kept).copied().collect();
            let start: Vec<f64> = truth.iter().map(|joint| joint + 0.02).collect();
            let near = inference.joints_near(&kept, &Prior::start(&start)).unwrap();
            assert_eq!(near.open.len(), open, "{cameras} cameras, {features} features: {:?}", near.open);
            let moved = near.joints.iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(moved < 0.3, "{moved} rad away from the start");
            // Along an open direction the pixels hardly move: by less than a pixel for a tenth of a radian.
            let model = Model::new(&rig).unwrap();
            for direction in &near.open {
                let along =
                    |s: f64| -> Vec<f64> { near.joints.iter().zip(direction).map(|(q, v)| q + s * v).collect() };
                let (high, low) = (model.links(&along(1e-5)), model.links(&along(-1e-5)));
                for sighting in &kept {
                    let pixel = |links| model.pixel(sighting.camera, sighting.feature, links);
                    let (a, b) = (pixel(&high), pixel(&low));
                    let speed = (a[0] - b[0]).hypot(a[1] - b[1]) / 2e-5;
                    assert!(speed < 10.0, "{speed} px/rad along {direction:?}");
                }
            }
            let found = inference.joints(&kept, &Prior::none()).unwrap();
            assert_eq!(found[0].open.len(), open);
            assert!(found[0].rms_px < 2.0, "{} px are left", found[0].rms_px);
        }
    }
    let nothing = inference.joints(&[], &Prior::none()).unwrap_err();
    assert!(nothing.to_string().contains("nothing that the joints move was seen"), "{nothing}");
    let read = Prior::readings(&[0.1, -1.5, 1.2, -1.0, -1.0, 0.3], 0.02);
    let prior = inference.joints(&[], &read).unwrap();
    assert_eq!((prior.len(), prior[0].open.len()), (1, 6));
    assert!(prior[0].joints.iter().zip(&read.mean).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!((prior[0].covariance[(2, 2)].sqrt() - 0.02).abs() < 1e-9);
    assert!(inference.joints(&[], &Prior::readings(&[0.0; 5], 0.1)).unwrap_err().to_string().contains("5 joints"));
}

#[test]
fn seven_joints_leave_one_direction_open_along_which_the_tip_stands_still() {
    for seed in 1..=5 {
        let rig = random_rig(7, 2, 12, seed);
        let (model, mut inference) = (Model::new(&rig).unwrap(), inference(&rig));
        for (seen, truth) in record(&rig, 5, seed) {
            let found = inference.joints(&seen, &Prior::start(&truth)).unwrap();
            let near = found.iter().min_by(|a, b| {
                let off = |branch: &Branch| error(&rig, branch, &truth).norm();
                off(a).total_cmp(&off(b))
            });
            let near = near.unwrap();
            assert!(error(&rig, near, &truth).norm() < 0.1, "rig {seed}");
            assert_eq!(near.open.len(), 1, "rig {seed}");
            let along =
                |s: f64| -> Vec<f64> { near.joints.iter().zip(&near.open[0]).map(|(q, v)| q + s * v).collect() };
            let (high, low) = (model.tip(&along(1e-4)), model.tip(&along(-1e-4)));
            let speed = (high.translation - low.translation).norm() / 2e-4;
            assert!(speed < 0.02 && high.angle_to(&low) / 2e-4 < 0.02, "rig {seed}: {speed} m/rad");
            let tip = model.tip(&truth);
            assert!((near.pose.translation - tip.translation).norm() < 0.01 && near.pose.angle_to(&tip) < 0.02);
        }
    }
}

#[test]
fn features_on_earlier_links_and_actions_tell_branches_apart() {
    let (mut alone, mut told, mut acted) = (0.0, 0.0, 0.0);
    for seed in 1..=10 {
        let mut rig = variants::on_links(seed);
        rig.noise.joint_action = 0.01;
        let free = unlimited(rig.clone());
        let mut inference = inference(&free);
        let recorded = record(&rig, 4, seed);
        let probability = |found: &[Branch], truth: &[f64]| -> f64 {
            let is_true = |branch: &&Branch| error(&free, branch, truth).amax() < 0.1;
            found.iter().filter(is_true).map(|branch| branch.probability).sum()
        };
        let on_tip = |seen: &[Sighting]| -> Vec<Sighting> { seen.iter().filter(|s| s.feature >= 4).copied().collect() };
        let only: Vec<(Vec<Sighting>, Vec<f64>)> =
            recorded.iter().map(|(seen, truth)| (on_tip(seen), truth.clone())).collect();
        for (seen, truth) in &recorded {
            told += probability(&inference.joints(seen, &Prior::none()).unwrap(), truth) / 40.0;
            alone += probability(&inference.joints(&on_tip(seen), &Prior::none()).unwrap(), truth) / 40.0;
        }
        // As a controller without readings: motions that were commanded exactly, executed with the noise of actions.
        for pair in only.windows(2) {
            let action: Vec<f64> = pair[1].1.iter().zip(&pair[0].1).map(|(next, now)| next - now + 0.005).collect();
            let moment = |at: usize, action: Option<Vec<f64>>| Moment { sightings: pair[at].0.clone(), action };
            let history = [moment(0, Some(action)), moment(1, None)];
            acted += probability(&inference.joints_of_history(&history, &Prior::none()).unwrap(), &pair[1].1) / 30.0;
        }
    }
    assert!(alone < 0.6, "the tip's features alone should not tell: {alone}");
    assert!(told > 0.97, "with features on earlier links: {told}");
    assert!(acted > 0.95, "with actions: {acted}");
}

#[test]
fn the_same_seed_infers_the_same_and_wrong_detections_do_not_spoil_it() {
    let rig = catalog::rig("ur5").unwrap();
    let (mut one, mut other) = (inference(&rig), inference(&rig));
    let mut right = 0;
    for (mut seen, truth) in record(&rig, 50, 4) {
        assert_eq!(one.joints(&seen, &Prior::none()).unwrap(), other.joints(&seen, &Prior::none()).unwrap());
        seen[3].pixel[0] += 80.0;
        seen[17].pixel[1] -= 60.0;
        let found = one.joints(&seen, &Prior::none()).unwrap();
        right += usize::from(error(&rig, &found[0], &truth).amax() < 0.05);
    }
    assert!(right >= 48, "{right} of 50 with two wrong detections");
}

/// A depth camera's points alone, to 1 mm, and beside its pixels: joints and poses are as far off as their covariance says, and one
/// wrong point of twelve moves them by less than it is off.
#[test]
fn points_of_depth_cameras_tell_of_joints_and_poses() {
    for with_pixels in [false, true] {
        let (mut of_joints, mut of_poses, mut joints, mut poses) = (0.0, 0.0, 0, 0);
        for seed in 0..60 {
            let mut rig = variants::depth(1, seed);
            rig.noise.points = 0.001;
            let options = SimulateOptions { samples: 1, seed, ..SimulateOptions::default() };
            let Simulation { recording, truth, .. } = simulate(&rig, &options).unwrap();
            let names = Names::new(&rig, &recording);
            let (pixels, mut points) = (names.sightings(&recording.samples[0]), names.points(&recording.samples[0]));
            if !with_pixels {
                let camera = &mut rig.cameras[0];
                (camera.fx, camera.fy, camera.cx, camera.cy) = (None, None, None, None);
            }
            let (model, mut inference) = (Model::new(&rig).unwrap(), inference(&rig));
            let true_joints = truth.samples[0].joints.as_ref().unwrap();
            let tip = model.tip(true_joints);
            // Without a lens, its pixels say nothing.
            let seen = Sightings { pixels: &pixels, points: &points };
            let pose = &inference.poses(seen)[0];
            let turn = so3::log(&(pose.pose.rotation * tip.rotation.transpose()));
            let shift = pose.pose.translation - tip.translation;
            let off = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            of_poses += pose.covariance.cholesky().unwrap().solve(&off).dot(&off);
            poses += 1;
            assert!(pose.rms_points_m > 0.0 && (pose.rms_px > 0.0) == with_pixels);
            let branches = inference.joints(seen, &Prior::none()).unwrap();
            let is_gaussian = |branch: &Branch| branch.covariance.diagonal().iter().all(|x| x.sqrt() < GAUSSIAN);
            if branches.iter().all(|branch| branch.open.is_empty() && is_gaussian(branch)) {
                of_joints += nearest(&rig, &branches, true_joints);
                joints += 1;
            }
            points[0].point[2] += 0.3;
            let spoilt = &inference.poses(Sightings { pixels: &pixels, points: &points })[0];
            let moved = (spoilt.pose.translation - tip.translation).norm();
            assert!(moved < 0.02, "seed {seed}: a point 0.3 m off moves the tip by {moved} m");
        }
        follows_chi_square(of_poses, 6 * poses);
        assert!(joints > 20, "{joints} arms are seen well enough");
        follows_chi_square(of_joints, 6 * joints);
    }
}
