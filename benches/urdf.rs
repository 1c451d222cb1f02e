//! Forward kinematics of URDFs as handeye reads and writes them; `benches/urdf.py` runs it and holds it against Pinocchio.
//!
//! Standard input: a JSON list of arms, `{"urdf", "base", "tip", "out", "joints": [[...]]}`. For each, the poses of every link and
//! of the tip at every row of joints, of the arm as it is and of the same with its rows disturbed, which is written to `out`.
use handeye::export::to_urdf;
use handeye::rig::{Model, Rig, read_text};
use handeye::solvers::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::Path;

/// By how much rows are disturbed [m and rad].
const DISTURBED: f64 = 0.02;

fn main() {
    if std::io::stdin().is_terminal() {
        return println!("run benches/urdf.py, which compares with Pinocchio");
    }
    let arms: Vec<Value> = serde_json::from_reader(std::io::stdin()).expect("a JSON list of arms");
    let answers: Vec<Value> =
        arms.iter().map(|arm| answer(arm).unwrap_or_else(|error| json!({ "error": error.to_string() }))).collect();
    println!("{}", Value::from(answers));
}

fn answer(arm: &Value) -> Result<Value, handeye::Error> {
    let text = |key: &str| arm[key].as_str().unwrap_or_default();
    let [urdf, base, tip] = ["urdf", "base", "tip"].map(text);
    let rig = Rig::parse(&format!("[robot]\nurdf = {urdf:?}\nbase = {base:?}\ntip = {tip:?}\n"), "rig.toml")?;
    let joints: Vec<Vec<f64>> = serde_json::from_value(arm["joints"].clone()).expect("rows of joints");
    let original = read_text(Path::new(urdf))?;
    // The rig file with rows, read back.
    let rows = Rig::parse(&rig.to_toml(), "rows")?;
    let mut disturbed = rows.clone();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for joint in &mut disturbed.robot.joints {
        for value in [&mut joint.offset, &mut joint.d, &mut joint.a, &mut joint.alpha, &mut joint.beta] {
            *value = value.map(|value| value + random.random_range(-DISTURBED..DISTURBED));
        }
    }
    let written = to_urdf(&disturbed, &original, urdf)?;
    std::fs::write(text("out"), &written).map_err(|source| handeye::Error::Io { path: text("out").into(), source })?;
    Ok(json!({
        "names": rig.robot.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
        "links": poses(&rig, &joints)?,
        "rows": poses(&rows, &joints)?,
        "disturbed": poses(&disturbed, &joints)?,
        "same_bytes": to_urdf(&rows, &original, urdf)? == original,
        "limits": rig.robot.joints.iter().map(|joint| [joint.limits.lower, joint.limits.upper, joint.limits.velocity]).collect::<Vec<_>>(),
        "betas": rig.robot.joints.iter().filter(|joint| joint.beta.is_some()).count(),
    }))
}

/// For every row of joints, the links' poses, each as twelve numbers: the rotation by rows, and the translation.
fn poses(rig: &Rig, joints: &[Vec<f64>]) -> Result<Vec<Vec<Vec<f64>>>, handeye::Error> {
    let model = Model::new(rig)?;
    let numbers = |pose: &Pose| pose.rotation.transpose().iter().chain(&pose.translation).copied().collect();
    Ok(joints.iter().map(|joints| model.links(joints)[1..].iter().map(numbers).collect()).collect())
}
