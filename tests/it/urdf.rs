//! Arms described by URDFs are read exactly, and what cannot be used is told.
use crate::cli::Folder;
use crate::malformed_input::place;
use handeye::Error;
use handeye::rig::{Model, Rig};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Six joints like those of many arms: parallel and crossing axes, fixed joints between, one axis that points backwards. Comments,
/// a mesh, a gripper with a joint that mimics another.
pub const ARM: &str = r#"<?xml version="1.0"?>
<!-- An arm. -->
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base_link"><visual><geometry><mesh filename="package://arm/base.stl" scale="0.001 0.001 0.001"/></geometry></visual></link>
  <link name="shoulder"/> <link name="upper_arm"/> <link name="elbow_mount"/> <link name="forearm"/>
  <link name="wrist_1"/> <link name="wrist_2"/> <link name="wrist_3"/> <link name="flange"/> <link name="tool0"/>
  <link name="base"/> <link name="finger"/> <link name="other_finger"/>

  <joint name="pan" type="revolute">
    <parent link="base_link"/>
    <child link="shoulder"/>
    <origin xyz="0 0 0.0892" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-0.9" upper="0.9" velocity="3.15" effort="150"/> <!-- effort is not used -->
  </joint>
  <joint name="lift" type="revolute">
    <parent link="shoulder"/>
    <child link="upper_arm"/>
    <origin rpy="0 1.5707963267948966 0" xyz="0 0.1358 0"></origin>
    <axis xyz="0 1 0"/>
    <limit lower="-1.9" upper="-1.0" velocity="3.15" effort="150"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="upper_arm"/>
    <child link="elbow_mount"/>
    <origin xyz="0 0.02 0.4" rpy="0.01 0.3 0"/>
  </joint>
  <joint name="elbow" type="revolute">
    <origin xyz='0.01  -0.13
 0.025'/>
    <parent link="elbow_mount"/>
    <child link="forearm"/>
    <axis xyz="0 -1 0"/>
    <limit lower="-1.9" upper="-0.8" velocity="3.15" effort="150"/>
  </joint>
  <joint name="roll" type="continuous">
    <parent link="forearm"/>
    <child link="wrist_1"/>
    <origin xyz="0 0 0.392" rpy="0 1.5707963267948966 0"/>
    <axis xyz="0 2 0"/>
    <limit velocity="3.2" effort="28"/>
  </joint>
  <joint name="bend" type="revolute">
    <parent link="wrist_1"/>
    <child link="wrist_2"/>
    <axis xyz="0.1 0.02 1"/>
    <limit lower="-2.5" upper="-0.6" velocity="3.2" effort="28"/>
  </joint>
  <joint name="turn" type="revolute">
    <parent link="wrist_2"/>
    <child link="wrist_3"/>
    <origin xyz="0 0 0.0946"/>
    <axis xyz="0 1 0"/>
    <limit lower="-3.1" upper="3.1" velocity="0" effort="28"/>
  </joint>
  <joint name="flange_joint" type="fixed">
    <parent link="wrist_3"/> <child link="flange"/>
    <origin xyz="0 0.0823 0" rpy="0 0 1.5707963267948966"/>
  </joint>
  <joint name="tool_joint" type="fixed">
    <parent link="flange"/> <child link="tool0"/>
    <origin rpy="1.2 0.3 -0.4"/>
  </joint>
  <joint name="base_joint" type="fixed">
    <parent link="base_link"/> <child link="base"/>
    <origin rpy="0 0 3.141592653589793"/>
  </joint>
  <joint name="finger_joint" type="prismatic">
    <parent link="tool0"/> <child link="finger"/>
    <axis xyz="1 0 0"/> <limit lower="0" upper="0.04" velocity="0.1" effort="1"/>
  </joint>
  <joint name="other_finger_joint" type="prismatic">
    <parent link="finger"/> <child link="other_finger"/>
    <axis xyz="-1 0 0"/> <limit lower="0" upper="0.04" velocity="0.1" effort="1"/>
    <mimic joint="finger_joint"/>
  </joint>
  <gazebo reference="base_link"/>
</robot>
"#;

/// A folder for each test, as tests run side by side.
fn name_of_folder() -> String {
    format!("urdf-{}", std::thread::current().name().unwrap_or("x").replace("::", "-"))
}

/// How messages begin that name a file of it.
fn folder_of() -> String {
    format!("{}/", Folder::new(&name_of_folder()).path().display())
}

pub fn rig_of(urdf: &str, robot: &str) -> Result<Rig, Error> {
    let folder = Folder::new(&name_of_folder());
    folder.write("arm.urdf", urdf).write("rig.toml", &format!("[robot]\nurdf = \"arm.urdf\"\n{robot}"));
    Rig::read(&folder.path().join("rig.toml"))
}

pub fn arm() -> Rig {
    rig_of(ARM, "base = \"base_link\"\ntip = \"tool0\"\n").unwrap()
}

/// Roll, pitch, yaw and translation by nalgebra.
pub fn placed(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
    Pose { rotation: Rotation3::from_euler_angles(roll, pitch, yaw).into_inner(), translation: Vector3::from(xyz) }
}

fn turned(axis: [f64; 3], angle: f64) -> Pose {
    Pose { rotation: so3::exp(&(Vector3::from(axis).normalize() * angle)), translation: Vector3::zeros() }
}

/// Links of the joints of `ARM` in its base, and the tip in place of the last, written down joint by joint.
fn links_by_hand(q: &[f64]) -> Vec<Pose> {
    const QUARTER: f64 = std::f64::consts::FRAC_PI_2;
    let steps = [
        placed([0.0, 0.0, 0.0892], [0.0; 3]) * turned([0.0, 0.0, 1.0], q[0]),
        placed([0.0, 0.1358, 0.0], [0.0, QUARTER, 0.0]) * turned([0.0, 1.0, 0.0], q[1]),
        placed([0.0, 0.02, 0.4], [0.01, 0.3, 0.0])
            * placed([0.01, -0.13, 0.025], [0.0; 3])
            * turned([0.0, -1.0, 0.0], q[2]),
        placed([0.0, 0.0, 0.392], [0.0, QUARTER, 0.0]) * turned([0.0, 2.0, 0.0], q[3]),
        turned([0.1, 0.02, 1.0], q[4]),
        placed([0.0, 0.0, 0.0946], [0.0; 3])
            * turned([0.0, 1.0, 0.0], q[5])
            * placed([0.0, 0.0823, 0.0], [0.0, 0.0, QUARTER])
            * placed([0.0; 3], [1.2, 0.3, -0.4]),
    ];
    steps
        .into_iter()
        .scan(Pose::identity(), |at, step| {
            *at = *at * step;
            Some(*at)
        })
        .collect()
}

pub fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.translation - b.translation).norm().max((a.rotation - b.rotation).amax())
}

pub fn positions(n_joints: usize, n: usize) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    (0..n).map(|_| (0..n_joints).map(|_| random.random_range(-3.2..3.2)).collect()).collect()
}

/// Largest distance of links between two rigs, of bases that both stand where they stand.
pub fn furthest(a: &Rig, b: &Rig) -> f64 {
    let [a, b] = [a, b].map(|rig| Model::new(&Rig { features: Vec::new(), ..rig.clone() }).unwrap());
    let apart = |q: &Vec<f64>| a.links(q).iter().zip(&b.links(q)).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
    positions(a.chain.len(), 200).iter().map(apart).fold(0.0, f64::max)
}

#[test]
fn links_and_tip_are_where_the_urdf_has_them() {
    let rig = arm();
    let model = Model::new(&rig).unwrap();
    for q in positions(6, 1000) {
        for (found, expected) in model.links(&q)[1..].iter().zip(&links_by_hand(&q)) {
            assert!(distance(found, expected) < 1e-12, "{:e}", distance(found, expected));
        }
    }
}

#[test]
fn names_limits_and_neighbouring_parallel_axes_are_taken_over() {
    let rig = arm();
    let joints = &rig.robot.joints;
    let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["pan", "lift", "elbow", "roll", "bend", "turn"]);
    let limits: Vec<_> =
        joints.iter().map(|joint| (joint.limits.lower, joint.limits.upper, joint.limits.velocity)).collect();
    assert_eq!(limits[0], (Some(-0.9), Some(0.9), Some(3.15)));
    assert_eq!(limits[3], (None, None, Some(3.2)), "continuous");
    assert_eq!(limits[5], (Some(-3.1), Some(3.1), None), "a speed of 0 is none");
    let betas: Vec<bool> = joints.iter().map(|joint| joint.beta.is_some()).collect();
    assert_eq!(betas, [false, false, true, true, false, false]);
    assert_eq!(rig.robot.link.as_deref(), Some("base_link"));
    assert_eq!(joints[5].link.as_deref(), Some("tool0"));
    assert_eq!(rig.robot.base, None);
}

#[test]
fn the_base_may_hang_on_the_arm_by_fixed_joints_and_stand_anywhere_in_the_world() {
    let pose = "pose = { xyz = [1, 2, 3], rpy = [0.1, 0.2, 0.3] }\n";
    let rig = rig_of(ARM, &format!("base = \"base\"\ntip = \"tool0\"\n{pose}")).unwrap();
    let model = Model::new(&rig).unwrap();
    let world_from_base_link =
        placed([1.0, 2.0, 3.0], [0.1, 0.2, 0.3]) * placed([0.0; 3], [0.0, 0.0, std::f64::consts::PI]).inverse();
    for q in positions(6, 50) {
        assert!(distance(&model.tip(&q), &(world_from_base_link * links_by_hand(&q)[5])) < 1e-12);
    }
    assert_eq!(model.links(&[0.0; 6])[0], rig.robot.base.unwrap());
    // Of the root, the pose may stand where it does without a URDF.
    let rooted = rig_of(ARM, &format!("tip = \"tool0\"\n{}", pose.replace("pose", "base"))).unwrap();
    assert_eq!((rooted.robot.link.as_deref(), rooted.robot.base), (Some("base_link"), rig.robot.base));
}

#[test]
fn a_rig_file_with_rows_is_the_same_arm() {
    let rig = arm();
    let rows = Rig::parse(&rig.to_toml(), "rows").unwrap();
    assert!(furthest(&rig, &rows) < 1e-13);
    assert_eq!(rows.to_toml(), rig.to_toml());
}

#[test]
fn what_a_urdf_cannot_be_used_for_is_told_with_its_place_and_the_reason() {
    let tail = "base = \"base_link\"\ntip = \"tool0\"\n";
    for (marked, right, words) in [
        ("name=\"bend\" type=\"@floating\"", "name=\"bend\" type=\"revolute\"", "type `floating` (an arm is"),
        (
            "name=\"bend\" type=\"@hinge\"",
            "name=\"bend\" type=\"revolute\"",
            "known: revolute, continuous, prismatic, fixed",
        ),
        ("<axis xyz=\"0 0 1\"/>@<mimic joint=\"turn\"/>", "<axis xyz=\"0 0 1\"/>", "joint `pan` mimics `turn`"),
        ("<axis xyz=\"@0 0 0\"/>", "<axis xyz=\"0 0 1\"/>", "joint `pan`: <axis>: an axis of length 0"),
        ("<axis xyz=\"@0 0\"/>", "<axis xyz=\"0 0 1\"/>", "joint `pan`: <axis>: `xyz`: expected 3 numbers, found 2"),
        ("xyz=\"@0 0 x\"", "xyz=\"0 0 0.0892\"", "expected a finite number, found `x`"),
        ("@<limit lower=\"1.9\"", "<limit lower=\"-0.9\"", "`lower` is 1.9, which is above `upper`, 0.9"),
        (
            "<parent link=\"@base_lin\"",
            "<parent link=\"base_link\"",
            "no link is called `base_lin` (did you mean `base_link`?)",
        ),
        ("@<joint name=\"pan\"", "<joint name=\"lift\"", "another joint is called `pan`"),
        (
            "<link name=\"flange\"/> @<link name=\"flange\"/>",
            "<link name=\"flange\"/>",
            "another link is called `flange`",
        ),
        ("<child link=\"base_link\"/>", "<child link=\"base\"/>", "joint `base_joint` hangs on itself"),
        ("@</robt>", "</robot>", "this is not XML: "),
        ("@<xacro:macro name=\"x\"/><gazebo", "<gazebo", "xacro FILE > robot.urdf"),
        ("@<joint name=\"pan\"", "<joint name=\"pan\" type=\"revolute\"", "joint `pan` has no `type`"),
        ("<origin @quat_xyzw=\"0 0 0 1\"", "<origin xyz=\"0 0 0.0892\"", "`quat_xyzw` is not read"),
    ] {
        let marked = ARM.replacen(right, marked, 1);
        assert_ne!(marked, ARM, "{right}");
        let error = rig_of(&marked.replacen('@', "", 1), tail).unwrap_err().to_string().replace(&folder_of(), "");
        if marked.contains('@') {
            let (_, line, column) = place(&marked);
            assert!(error.starts_with(&format!("arm.urdf:{line}:{column}: ")), "{words}\n{error}");
        }
        assert!(error.contains(words), "{words}\n{error}");
    }
    let error = rig_of("<sdf/>", tail).unwrap_err().to_string().replace(&folder_of(), "");
    assert_eq!(error, "arm.urdf:1:1: expected <robot> of a URDF, found <sdf>");
    for (robot, place, words) in [
        ("tip = \"tool1\"\n", "rig.toml:3:7: ", "no link of arm.urdf is called `tool1` (did you mean `tool0`?)"),
        (
            "tip = \"tool0\"\nbase = { xyz = [0, 0, 0], quat = [0, 0, 0, 1] }\npose = { xyz = [0, 0, 0], quat = [0, 0, 0, 1] }\n",
            "rig.toml:5:8: ",
            "`base` is a pose already",
        ),
        ("", "rig.toml:1:", "has no `tip`, the name of a link, and of arm.urdf `base`, `other_finger` are the ends"),
        ("tip = \"base\"\n", "rig.toml:2:8: ", "nothing moves between link `base_link` and link `base`"),
        (
            "base = \"tool0\"\ntip = \"shoulder\"\n",
            "rig.toml:2:8: ",
            "no joints lead from link `tool0` to link `shoulder`",
        ),
        ("tip = \"tool0\"\nconvention = \"dh\"\n", "rig.toml:4:14: ", "described by `urdf`"),
    ] {
        let error = rig_of(ARM, robot).unwrap_err().to_string().replace(&folder_of(), "");
        assert!(error.starts_with(place) && error.contains(words), "{robot}\n{error}");
    }
    let error = Rig::parse("[robot]\nurdf = \"absent.urdf\"\n", "x/rig.toml").unwrap_err().to_string();
    assert!(error.starts_with("x/rig.toml:2:8: robot: `urdf`: x/absent.urdf: "), "{error}");
    let error = Rig::parse("[robot]\ntip = \"tool0\"\n", "rig.toml").unwrap_err().to_string();
    assert!(error.starts_with("rig.toml:2:7: robot: `tip`: goes with `urdf`"), "{error}");
}
