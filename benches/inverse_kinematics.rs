//! Inverse kinematics of 2,000 poses of a UR5 and of a Panda: CPU time of a call, and whether the pose is reached.
//!
//! `cargo bench --bench inverse_kinematics -- [OUT.json]` writes joints and times too; `benches/inverse_kinematics.py` runs peers on
//! the same poses and checks all of them with a forward kinematics of its own.
use cpu_time::ThreadTime;
use handeye::chain::Convention;
use handeye::infer::{InverseKinematics, InverseOptions};
use handeye::rig::{Limits, Model, Rig};
use handeye::solvers::{Pose, manifold::so3};
use nalgebra::Vector3;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

#[path = "common/dh_rows.rs"]
mod dh_rows;

/// What counts as reached [m, rad], and the required times [µs]: median and 99 %.
const REACHED: f64 = 1e-5;
const REQUIRED: [(&str, f64, f64); 2] = [("ur5", 45.0, 600.0), ("panda", 100.0, 600.0)];

fn main() {
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let mut all = Map::new();
    println!("robot    reached  median µs  99 % µs  largest µs  starts");
    for (name, median_us, last_us) in REQUIRED {
        let path = folder.join("cases").join(format!("ik_{name}.json"));
        let Ok(text) = std::fs::read_to_string(&path) else {
            return println!("{} is not there: set HANDEYE_SHARED to its folder", path.display());
        };
        let cases: Value = serde_json::from_str(&text).expect("the file is whole");
        let rig = rig(&cases);
        let model = Model::new(&rig).expect("complete");
        let mut inverse = InverseKinematics::new(&rig, InverseOptions::default()).expect("complete");
        let (mut times, mut joints, mut reached, mut starts) = (Vec::new(), Vec::new(), 0, 0);
        let (poses, seeds) = (rows(&cases["pose"]), rows(&cases["q_seed"]));
        for (pose, seed) in poses.iter().zip(&seeds) {
            let [x, y, z, qx, qy, qz, qw] = pose[..] else { panic!("a pose has 7 numbers") };
            let target = Pose { rotation: so3::from_quaternion([qx, qy, qz, qw]), translation: Vector3::new(x, y, z) };
            let start = ThreadTime::now();
            let found = inverse.solve(&target, seed);
            times.push(1e6 * start.elapsed().as_secs_f64());
            let tip = model.tip(&found.joints);
            let near = (tip.translation - target.translation).norm() < REACHED && tip.angle_to(&target) < REACHED;
            reached += usize::from(near);
            starts += found.starts;
            joints.push(found.joints);
        }
        all.insert(name.to_owned(), json!({ "joints": joints, "us": times }));
        times.sort_by(f64::total_cmp);
        let n = times.len();
        let (median, last) = (times[n / 2], times[n * 99 / 100]);
        println!(
            "{name:7} {reached:>5} of {n} {median:>6.1} {last:>8.1} {:>11.1} {:>7.2}",
            times[n - 1],
            starts as f64 / n as f64
        );
        let met = reached == n && median <= median_us && last <= last_us;
        println!("  required: all, {median_us} and {last_us}: {}", if met { "met" } else { "NOT MET" });
    }
    if let Some(path) = std::env::args().skip(1).find(|argument| argument.ends_with(".json")) {
        std::fs::write(&path, Value::Object(all).to_string()).expect("can be written");
    }
}

fn rig(cases: &Value) -> Rig {
    let mut rig = Rig::default();
    rig.robot.convention = if cases["dh_convention"] == "standard" { Convention::Dh } else { Convention::ModifiedDh };
    for (i, (row, limits)) in rows(&cases["dh"]).iter().zip(rows(&cases["limits"])).enumerate() {
        let limits = Limits { lower: Some(limits[0]), upper: Some(limits[1]), ..Limits::default() };
        rig.robot.joints.push(dh_rows::joint(i, row, limits));
    }
    rig
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    let row = |row: &Value| row.as_array().expect("a row").iter().filter_map(Value::as_f64).collect();
    value.as_array().expect("rows").iter().map(row).collect()
}
