//! Promises of the relative pose: exact, noisy, spoilt, planar and degenerate correspondences.
use super::*;
use crate::geometry::ransac::tests::{Random, distance};

struct Scene {
    truth: Pose,
    a: Vec<Vector3<f64>>,
    b: Vec<Vector3<f64>>,
    outliers: usize,
}

/// Two cameras 0.5 to 1.5 m apart look at points within 1 m, 3 m away; the first `outliers` correspondences are wrong.
fn scene(seed: u64, n: usize, sigma: f64, outlier_share: f64, planar: bool) -> Scene {
    let mut random = Random::new(seed);
    let baseline = random.vector(1.0).normalize() * (1.0 + random.vector(0.5).x);
    // Turned about the points, so that they stay in view.
    let rotation = handeye_solvers::manifold::so3::exp(&random.vector(0.4));
    let centre = Vector3::z() * 3.0;
    let mut truth = Pose { rotation, translation: centre - rotation * centre + baseline };
    let outliers = (n as f64 * outlier_share) as usize;
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for i in 0..n {
        let mut point = random.vector(1.0) + centre;
        if planar {
            point.z = 3.0 + 0.4 * point.x - 0.2 * point.y;
        }
        let other = random.vector(1.0) + centre;
        a.push(random.tilted(&point.normalize(), sigma));
        b.push(random.tilted(&truth.transform(if i < outliers { &other } else { &point }).normalize(), sigma));
    }
    truth.translation.normalize_mut();
    Scene { truth, a, b, outliers }
}

/// Angles to the truth, of rotation and baseline [rad].
fn errors(found: &Pose, truth: &Pose) -> [f64; 2] {
    [found.angle_to(truth), found.translation.angle(&truth.translation)]
}

#[test]
fn exact_correspondences_give_the_exact_pose() {
    let mut right = 0;
    for seed in 0..100 {
        for planar in [false, true] {
            let scene = scene(seed, 20, 0.0, 0.0, planar);
            let candidates = relative_pose_candidates(&scene.a, &scene.b, 1e-3, seed);
            right += usize::from(candidates.iter().any(|c| distance(&c.b_from_a, &scene.truth) < 1e-8));
        }
    }
    assert!(right >= 198, "{right} of 200");
}

// 0.5 px at a focal length of 600 px.
#[test]
fn half_a_pixel_of_noise_and_a_third_of_wrong_correspondences_are_survived() {
    let sigma = 0.5 / 600.0;
    for (n, share, tolerance, needed) in [(600, 0.35, 0.02, 100), (60, 0.3, 0.1, 99), (15, 0.0, 0.3, 95)] {
        let mut right = 0;
        for seed in 0..100 {
            let scene = scene(seed, n, sigma, share, false);
            let Some(found) = relative_pose(&scene.a, &scene.b, 3.0 * sigma, seed) else { continue };
            let [turn, swing] = errors(&found.b_from_a, &scene.truth);
            let caught = found.inliers.iter().filter(|&&i| i < scene.outliers).count();
            right += usize::from(turn < tolerance && swing < 2.0 * tolerance && caught * 5 <= scene.outliers);
        }
        assert!(right >= needed, "{right} of 100 at {n}");
    }
}

#[test]
fn points_in_a_plane_leave_the_truth_among_the_candidates() {
    let sigma = 0.5 / 600.0;
    let mut right = 0;
    for seed in 0..100 {
        let scene = scene(seed, 50, sigma, 0.1, true);
        let candidates = relative_pose_candidates(&scene.a, &scene.b, 3.0 * sigma, seed);
        right += usize::from(candidates.iter().any(|c| errors(&c.b_from_a, &scene.truth).iter().all(|e| *e < 0.15)));
        assert!(candidates.windows(2).all(|pair| pair[0].cost <= pair[1].cost));
    }
    assert!(right >= 97, "{right} of 100");
}

#[test]
fn the_same_seed_gives_the_same_pose() {
    let scene = scene(3, 200, 1e-3, 0.3, false);
    let run = || relative_pose_candidates(&scene.a, &scene.b, 3e-3, 9);
    assert_eq!(run(), run());
}

#[test]
fn what_leaves_the_pose_open_gives_none() {
    let scene = scene(1, 30, 0.0, 0.0, false);
    assert_eq!(relative_pose(&scene.a[..4], &scene.b[..4], 1e-3, 0), None);
    assert_eq!(relative_pose(&scene.a, &scene.b[1..], 1e-3, 0), None);
    assert_eq!(relative_pose(&scene.a, &scene.a, 1e-3, 0), None);
    let turned: Vec<_> = scene.a.iter().map(|v| scene.truth.rotation * v).collect();
    assert_eq!(relative_pose(&scene.a, &turned, 1e-3, 0), None);
    assert_eq!(relative_pose(&[Vector3::z(); 9], &[Vector3::x(); 9], 1e-3, 0), None);
    assert_eq!(relative_pose(&[Vector3::repeat(f64::NAN); 9], &scene.b[..9], 1e-3, 0), None);
    let points = (0..20).map(|i| Vector3::new(0.1, 0.2, 3.0) + Vector3::new(0.1, -0.05, 0.03) * f64::from(i));
    let (a, b): (Vec<_>, Vec<_>) =
        points.map(|p| (p.normalize(), (scene.truth.rotation * p + Vector3::x()).normalize())).unzip();
    assert_eq!(relative_pose(&a, &b, 1e-3, 0), None);
}
