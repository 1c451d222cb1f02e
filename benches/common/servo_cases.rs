//! The servoing problems that ViSP was measured on, as rigs: `cases/servo_ur5.json`.
use handeye::rig::{Camera, Feature, Limits, Parent, Rig};
use handeye::solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

#[path = "dh_rows.rs"]
mod dh_rows;

/// A set of problems: start and target joints [rad] of one rig.
pub struct Cases {
    pub rig: Rig,
    pub pairs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Cases {
    /// `set`: "mid" (two cameras in the world, features on the flange) or "eih" (a camera on the flange, points in the world).
    pub fn new(text: &str, set: &str) -> Cases {
        let all: Value = serde_json::from_str(text).expect("the file is whole");
        let eye_in_hand = set == "eih";
        let mut rig = Rig::default();
        rig.robot.base = Some(Pose::identity());
        for (i, row) in list(&all["robot"]["dh"]).iter().enumerate() {
            rig.robot.joints.push(dh_rows::joint(i, &numbers(row), Limits::default()));
        }
        let lens = &all["camera_intrinsics"];
        let number = |key: &str| lens[key].as_f64();
        let poses =
            if eye_in_hand { vec![all["eye_in_hand"]["eMc"].clone()] } else { list(&all["cameras_wMc"]).to_vec() };
        for (i, rows) in poses.iter().enumerate() {
            rig.cameras.push(Camera {
                name: format!("cam{i}"),
                size: Some([640, 480]),
                fx: number("fx"),
                fy: number("fy"),
                cx: number("cx"),
                cy: number("cy"),
                parent: if eye_in_hand { Parent::Tip } else { Parent::World },
                pose: Some(pose(rows)),
                ..Camera::default()
            });
        }
        let points = if eye_in_hand { &all["eye_in_hand"]["world_points"] } else { &all["features_flange"] };
        for (i, point) in list(points).iter().enumerate() {
            let parent = if eye_in_hand { Parent::World } else { Parent::Tip };
            let xyz = numbers(point).try_into().ok();
            rig.features.push(Feature { name: format!("f{i}"), parent, xyz });
        }
        let pair = |case: &Value| (numbers(&case["start"]), numbers(&case["target"]));
        let pairs = list(&all["sets"][set]["cases"]).iter().map(pair).collect();
        Cases { rig, pairs }
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn pose(rows: &Value) -> Pose {
    let rows: Vec<Vec<f64>> = list(rows).iter().map(numbers).collect();
    Pose { rotation: Matrix3::from_fn(|i, j| rows[i][j]), translation: Vector3::from_fn(|i, _| rows[i][3]) }
}
