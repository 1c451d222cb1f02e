//! Standard deviations of what is measured and commanded, in words, tables and JSON.
use super::table::Table;
use super::words::{mm, px};
use handeye::calibrate::NoiseTrial;
use handeye::rig::{Noise, PoseNoise};
use serde_json::{Value, json};

/// Everything that is not exact, of what was recorded.
pub fn in_words(noise: &Noise, (has_pixels, has_points): (bool, bool)) -> String {
    let mut parts = Vec::new();
    parts.extend(has_pixels.then(|| format!("pixels {:.3} px", noise.pixels)));
    let pose =
        |name: &str, noise: PoseNoise| format!("{name} {:.2} mm and {:.3} mrad", 1e3 * noise.xyz, 1e3 * noise.rot);
    let scalar = |name: &str, sd: f64| format!("{name} {:.3} mrad (or mm)", 1e3 * sd);
    parts.extend(has_points.then(|| format!("points {:.3} mm", 1e3 * noise.points)));
    parts.extend((noise.joints > 0.0).then(|| scalar("joints", noise.joints)));
    parts.extend(noise.pose.is_noisy().then(|| pose("tip poses", noise.pose)));
    parts.extend((noise.joint_action > 0.0).then(|| scalar("joint actions", noise.joint_action)));
    parts.extend(noise.pose_action.is_noisy().then(|| pose("pose actions", noise.pose_action)));
    parts.join(", ")
}

/// As in the rig file's `[noise]`.
pub fn json(noise: &Noise) -> Value {
    let pose = |noise: PoseNoise| json!({ "xyz": noise.xyz, "rot": noise.rot });
    json!({
        "pixels": noise.pixels,
        "points": noise.points,
        "joints": noise.joints,
        "pose": pose(noise.pose),
        "joint_action": noise.joint_action,
        "pose_action": pose(noise.pose_action),
    })
}

pub fn trials_table(trials: &[NoiseTrial]) -> String {
    let best = NoiseTrial::best(trials);
    let has_points = trials.iter().any(|trial| trial.mean_points_m > 0.0 && trial.mean_points_m.is_finite());
    let header = ["noise of states", "joints", "pose xyz", "pose rot", "held out, mean px"].into_iter();
    let mut table = Table::new(&header.chain(has_points.then_some("mean mm")).chain([""]).collect::<Vec<_>>());
    for trial in trials {
        let Noise { joints, pose, .. } = trial.noise;
        let chosen = if Some(trial) == best { "chosen" } else { "" };
        table.row(
            [format!("x {}", trial.factor)]
                .into_iter()
                .chain([joints, pose.xyz, pose.rot].map(|sd| format!("{sd:.2e}")))
                .chain([px(trial.mean_px)])
                .chain(has_points.then(|| mm(trial.mean_points_m)))
                .chain([chosen.to_owned()]),
        );
    }
    format!("noise of states by how well samples held out of the fit are predicted:\n{table}")
}

pub fn trials_json(trials: &[NoiseTrial]) -> Value {
    let trial = |trial: &NoiseTrial| {
        let (px, mm) = (trial.mean_px, 1e3 * trial.mean_points_m);
        json!({ "factor": trial.factor, "noise": json(&trial.noise), "mean_px": px, "mean_points_mm": mm })
    };
    trials.iter().map(trial).collect()
}
