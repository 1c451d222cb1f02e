//! Rigs of other kinds than the plain random arm with cameras in the world.
use handeye::chain::{Convention, JointKind};
use handeye::recording::{RecordedCamera, Recording};
use handeye::rig::{Estimate, Model, Parent, Rig, catalog};
use handeye::simulate::random_rig;
use handeye::solvers::Pose;
use nalgebra::Vector3;

/// The shipped UR5, whose axes 2, 3 and 4 are parallel.
pub fn ur5(_: u64) -> Rig {
    catalog::rig("ur5").expect("the shipped rig is valid")
}

/// What a person who knows nothing but what is where would write: kinds of joints, and what is fixed to what if that is not
/// cameras in the world and features on the tip.
pub fn forgotten(truth: &Rig) -> Rig {
    let mut rig = Rig { noise: truth.noise, estimate: Estimate::default(), ..Rig::default() };
    rig.robot.convention = truth.robot.convention;
    if truth.robot.joints.iter().any(|joint| joint.kind == JointKind::Prismatic)
        || truth.features.iter().any(|feature| matches!(feature.parent, Parent::Link(_)))
    {
        rig.robot.joints = truth.robot.joints.clone();
        for joint in &mut rig.robot.joints {
            (joint.offset, joint.d, joint.a, joint.alpha, joint.beta) = (None, None, None, None, None);
        }
    }
    if truth.cameras.iter().any(|camera| camera.parent != Parent::World) {
        rig.cameras = truth.cameras.clone();
        rig.cameras.iter_mut().for_each(|camera| camera.pose = None);
    }
    if truth.features.iter().any(|feature| feature.parent != Parent::Tip) {
        rig.features = truth.features.clone();
        rig.features.iter_mut().for_each(|feature| feature.xyz = None);
    }
    rig
}

/// All features in one plane of the tip, as on a board.
pub fn planar(cameras: usize, seed: u64) -> Rig {
    let mut rig = random_rig(6, cameras, 12, seed);
    for feature in &mut rig.features {
        if let Some(xyz) = &mut feature.xyz {
            xyz[2] = 0.02 + 0.3 * xyz[0];
        }
    }
    rig
}

/// The same arm in Craig's convention: each row takes over a and alpha of the one before.
pub fn modified(seed: u64) -> Rig {
    let mut rig = random_rig(6, 2, 12, seed);
    rig.robot.convention = Convention::ModifiedDh;
    let joints = &mut rig.robot.joints;
    let last = joints.last().map_or((0.0, 0.0), |joint| (joint.a.unwrap_or(0.0), joint.alpha.unwrap_or(0.0)));
    for i in (1..joints.len()).rev() {
        (joints[i].a, joints[i].alpha) = (joints[i - 1].a, joints[i - 1].alpha);
    }
    (joints[0].a, joints[0].alpha) = (Some(0.0), Some(0.0));
    let tool = Pose::new(Vector3::new(last.1, 0.0, 0.0), Vector3::new(last.0, 0.0, 0.0));
    for feature in &mut rig.features {
        feature.xyz = feature.xyz.map(|xyz| tool.transform(&xyz.into()).into());
    }
    rig
}

/// The third joint slides by up to 15 cm instead of turning.
pub fn prismatic(seed: u64) -> Rig {
    let mut rig = random_rig(6, 2, 12, seed);
    let joint = &mut rig.robot.joints[2];
    let middle = 0.5 * (joint.limits.lower.unwrap_or(0.0) + joint.limits.upper.unwrap_or(0.0));
    joint.kind = JointKind::Prismatic;
    joint.offset = Some(joint.offset.unwrap_or(0.0) + middle);
    (joint.limits.lower, joint.limits.upper) = (Some(-0.15), Some(0.15));
    rig
}

/// Cameras on the tip watch features in the world, 40 cm ahead of it where all joints are in the middle of their ranges.
pub fn on_hand(cameras: usize, seed: u64) -> Rig {
    let mut rig = random_rig(6, cameras, 12, seed);
    let home = home(&rig);
    for joint in &mut rig.robot.joints {
        let (lower, upper) = (joint.limits.lower.unwrap_or(-1.0), joint.limits.upper.unwrap_or(1.0));
        let (middle, half) = (0.5 * (lower + upper), 0.25 * (upper - lower));
        (joint.limits.lower, joint.limits.upper) = (Some(middle - half), Some(middle + half));
    }
    let tip = Model::new(&rig).expect("a random rig is complete").tip(&home);
    for (index, camera) in rig.cameras.iter_mut().enumerate() {
        let side = if index == 0 { -1.0 } else { 1.0 };
        camera.parent = Parent::Tip;
        camera.pose = Some(Pose::new(Vector3::new(0.05, -0.2 * side, 0.1), Vector3::new(0.08 * side, 0.02, 0.03)));
    }
    for feature in &mut rig.features {
        feature.parent = Parent::World;
        feature.xyz = feature.xyz.map(|[x, y, z]| tip.transform(&Vector3::new(x, y, z + 0.4)).into());
    }
    rig
}

/// Four of the features are on the link of the fourth joint.
pub fn on_links(seed: u64) -> Rig {
    let mut rig = random_rig(6, 2, 12, seed);
    let links = Model::new(&rig).expect("a random rig is complete").links(&home(&rig));
    for feature in rig.features.iter_mut().take(4) {
        feature.parent = Parent::Link(3);
        let in_world = feature.xyz.map(|xyz| links[6].transform(&xyz.into()));
        feature.xyz = in_world.map(|point| links[4].inverse_transform(&point).into());
    }
    rig
}

/// Camera poses are known and held, all else is forgotten.
pub fn cameras_held(truth: &Rig) -> Rig {
    let mut rig = forgotten(truth);
    rig.cameras = truth.cameras.clone();
    rig.estimate.fixed = vec!["cameras.*.pose".to_owned()];
    rig
}

/// The joints' twists are known and held, as are the first two link lengths.
pub fn twists_held(truth: &Rig) -> Rig {
    let mut rig = forgotten(truth);
    rig.robot.joints = truth.robot.joints.clone();
    for (index, joint) in rig.robot.joints.iter_mut().enumerate() {
        (joint.offset, joint.d) = (None, None);
        joint.a = joint.a.filter(|_| index < 2);
    }
    rig.estimate.fixed = vec!["robot.joints.*.alpha".to_owned()];
    rig
}

/// The chain is known up to a millimetre and a milliradian, as from a data sheet.
pub fn nominal(truth: &Rig) -> Rig {
    let mut rig = forgotten(truth);
    rig.robot = truth.robot.clone();
    for (index, joint) in rig.robot.joints.iter_mut().enumerate() {
        let sign = if index % 2 == 0 { 1e-3 } else { -1e-3 };
        joint.offset = joint.offset.map(|offset| offset + sign);
        joint.d = joint.d.map(|d| d - sign);
        joint.a = joint.a.map(|a| a + sign);
        joint.alpha = joint.alpha.map(|alpha| alpha - sign);
    }
    rig
}

/// The features are known, as of a printed board; the rest is forgotten.
pub fn structure(truth: &Rig) -> Rig {
    let mut rig = forgotten(truth);
    rig.features = truth.features.clone();
    rig
}

fn home(rig: &Rig) -> Vec<f64> {
    let middle =
        |joint: &handeye::rig::Joint| 0.5 * (joint.limits.lower.unwrap_or(0.0) + joint.limits.upper.unwrap_or(0.0));
    rig.robot.joints.iter().map(middle).collect()
}

/// The first camera gives points too, to 5 mm.
pub fn depth(cameras: usize, seed: u64) -> Rig {
    let mut rig = random_rig(6, cameras, 12, seed);
    rig.cameras[0].depth = true;
    rig
}

/// Takes the pixels and intrinsics of depth cameras out of a recording.
pub fn points_alone(truth: &Rig, recording: &mut Recording) {
    let depth: Vec<bool> = truth.cameras.iter().map(|camera| camera.depth).collect();
    for (camera, _) in recording.cameras.iter_mut().zip(&depth).filter(|(_, depth)| **depth) {
        *camera = RecordedCamera { name: camera.name.clone(), ..RecordedCamera::default() };
    }
    recording.samples.iter_mut().for_each(|sample| sample.pixels.retain(|seen| !depth[seen.camera as usize]));
}
