//! The arm of a rig in the URDF that it began as: calibrated joint origins, and everything else as it was.
use crate::Error;
use crate::rig::{Model, Rig, Robot};
use crate::urdf::Urdf;
use handeye_solvers::Pose;

/// Distance and angle by which the written URDF may miss the rig [m and rad].
const AGREES: f64 = 1e-9;
/// Joint positions at which the two are compared.
const POSITIONS: usize = 20;

/// The text of the URDF `original`, which messages call `file`, with the arm of the rig in it.
///
/// The URDF that comes of it has been read back, and its links found where those of the rig are, to 1e-9 m and rad.
///
/// Errors: [`Error::Malformed`] where the URDF is, [`Error::Unusable`] where the rig has no names of links, is not complete or
/// is not an arm of this URDF.
pub fn to_urdf(rig: &Rig, original: &str, file: &str) -> Result<String, Error> {
    let robot = &rig.robot;
    let (Some(base), Some(tip)) = (&robot.link, robot.joints.last().and_then(|joint| joint.link.as_ref())) else {
        return Err(Error::Unusable(
            "the rig does not say which links of a URDF its base and its tip are: it has to begin as [robot] urdf = \"...\""
                .into(),
        ));
    };
    let urdf = Urdf::parse(original, file)?;
    let described = urdf.arm(base, tip)?;
    let names = |names: Vec<&str>| names.join(", ");
    let [ours, theirs] = [
        names(robot.joints.iter().map(|joint| joint.name.as_str()).collect()),
        names(described.joints.iter().map(|joint| joint.name.as_str()).collect()),
    ];
    if ours != theirs {
        return Err(Error::Unusable(format!(
            "the rig has the joints {ours}; of {file} `{base}` moves `{tip}` by {theirs}"
        )));
    }
    let learned = on_its_base(robot)?;
    let text = urdf.with_links(base, tip, &learned.links(&vec![0.0; robot.joints.len()])[1..])?;
    let written = on_its_base(&Robot::from(Urdf::parse(&text, file)?.arm(base, tip)?))?;
    for position in 0..POSITIONS {
        // Anywhere: a sequence that fills the range of every joint.
        let joints: Vec<f64> = (1..=robot.joints.len())
            .map(|joint| ((position * position + 1) as f64 * (joint as f64).sqrt()).sin() * std::f64::consts::PI)
            .collect();
        for ((a, b), joint) in learned.links(&joints).iter().zip(&written.links(&joints)).skip(1).zip(&robot.joints) {
            let (shift, turn) = ((a.translation - b.translation).norm(), a.angle_to(b));
            if shift.max(turn) > AGREES {
                return Err(Error::Unusable(format!(
                    "origins of {file} cannot say what the rig says: the link of joint `{}` would be {:.3e} m and {turn:.3e} rad off, \
                     since the axis or the frame of a link is not that of the URDF",
                    joint.name, shift
                )));
            }
        }
    }
    Ok(text)
}

/// The chain alone, the world in its base.
fn on_its_base(robot: &Robot) -> Result<Model, Error> {
    let robot = Robot { base: Some(Pose::identity()), ..robot.clone() };
    Model::new(&Rig { robot, ..Rig::default() })
}
