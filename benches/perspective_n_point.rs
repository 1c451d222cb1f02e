//! The pose of a camera from points, 1,000 cases each: errors and CPU time.
//!
//! `cargo bench --bench perspective_n_point -- [OUT.json]` writes the cases and what was found; `benches/perspective_n_point.py` solves
//! them with OpenCV too. One camera with f = 600 px, 0.5 px of noise, points within ±5 cm at 0.6 to 2 m.
use cpu_time::ThreadTime;
use handeye::geometry::resect;
use handeye::solvers::{Pose, manifold::so3};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

const CASES: usize = 1000;
const FOCAL: f64 = 600.0;
const SIGMA: f64 = 0.5;

fn main() {
    let mut all: Vec<Value> = Vec::new();
    println!("points           median °  median mm  over 5°   worst °  median µs   99 % µs");
    for (n, thick) in [(12, 1.0), (6, 1.0), (4, 1.0), (12, 0.0)] {
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let (mut rot, mut xyz, mut us) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..CASES {
            let (truth, points, pixels) = case(random, n, thick);
            let bearing = |pixel: &[f64; 2]| Vector3::new(pixel[0] / FOCAL, pixel[1] / FOCAL, 1.0).normalize();
            let start = ThreadTime::now();
            let bearings: Vec<_> = pixels.iter().map(bearing).collect();
            let found = resect(&points, &bearings).first().copied();
            us.push(1e6 * start.elapsed().as_secs_f64());
            rot.push(found.map_or(180.0, |pose| pose.angle_to(&truth).to_degrees()));
            xyz.push(found.map_or(f64::INFINITY, |pose| 1e3 * (pose.translation - truth.translation).norm()));
            let rows: Vec<&[f64]> = points.iter().map(|point| point.as_slice()).collect();
            all.push(json!({
                "set": format!("{n}{}", if thick > 0.0 { "" } else { ", planar" }),
                "rotation": truth.rotation.transpose().as_slice(), "translation": truth.translation.as_slice(),
                "points": rows, "pixels": pixels, "deg": rot.last(), "mm": xyz.last(), "us": us.last(),
            }));
        }
        let over = rot.iter().filter(|angle| **angle > 5.0).count();
        [&mut rot, &mut xyz, &mut us].into_iter().for_each(|list| list.sort_by(f64::total_cmp));
        let name = format!("{n}{}", if thick > 0.0 { "" } else { ", planar" });
        println!(
            "{name:15} {:>9.3} {:>10.2} {over:>8} {:>9.2} {:>10.1} {:>9.1}",
            rot[CASES / 2],
            xyz[CASES / 2],
            rot[CASES - 1],
            us[CASES / 2],
            us[CASES * 99 / 100]
        );
    }
    if let Some(path) = std::env::args().skip(1).find(|argument| argument.ends_with(".json")) {
        std::fs::write(&path, json!(all).to_string()).expect("can be written");
    }
}

/// `camera_from_points`, the points [m] and where they are seen [px from the principal point].
fn case(random: &mut ChaCha8Rng, n: usize, thick: f64) -> (Pose, Vec<Vector3<f64>>, Vec<[f64; 2]>) {
    let mut uniform = |half: f64| half * (2.0 * random.random::<f64>() - 1.0);
    let quaternion = [uniform(1.0), uniform(1.0), uniform(1.0), uniform(1.0)];
    let depth = 1.3 + uniform(0.7);
    let translation = Vector3::new(uniform(0.3) * depth, uniform(0.25) * depth, depth);
    let truth = Pose { rotation: so3::from_quaternion(quaternion), translation };
    let points: Vec<_> = (0..n).map(|_| Vector3::new(uniform(0.05), uniform(0.05), thick * uniform(0.05))).collect();
    let mut noise = || -> f64 { StandardNormal.sample(random) };
    let pixel = |point: &Vector3<f64>| {
        let p = truth.transform(point);
        [FOCAL * p.x / p.z + SIGMA * noise(), FOCAL * p.y / p.z + SIGMA * noise()]
    };
    let pixels = points.iter().map(pixel).collect();
    (truth, points, pixels)
}
