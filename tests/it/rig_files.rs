//! A rig file read back is the file written, and an author's comments stay.
use handeye::camera::CameraModel;
use handeye::chain::{Convention, JointKind};
use handeye::rig::*;
use handeye::solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rounding of a rotation that goes through a quaternion.
const ROUNDING: f64 = 2e-15;

pub fn random_pose(random: &mut ChaCha8Rng) -> Pose {
    let mut vector = |size: f64| Vector3::from_fn(|_, _| random.random_range(-size..size));
    Pose::new(vector(3.0), vector(2.0))
}

/// A number as files have them: often round, sometimes tiny or huge.
pub fn random_number(random: &mut ChaCha8Rng) -> f64 {
    match random.random_range(0..6) {
        0 => 0.0,
        1 => f64::from(random.random_range(-100..100)),
        2 => random.random_range(-1.0..1.0) * 1e-12,
        3 => random.random_range(-1.0..1.0) * 1e18,
        _ => random.random_range(-3.0..3.0),
    }
}

fn maybe<T>(random: &mut ChaCha8Rng, make: impl FnOnce(&mut ChaCha8Rng) -> T) -> Option<T> {
    random.random_bool(0.7).then(|| make(random))
}

fn random_rig(seed: u64) -> Rig {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut rig =
        Rig { name: maybe(random, |r| format!("rig \"{}\" ü\\\n#", r.random_range(0..9))), ..Rig::default() };
    rig.robot.convention = Convention::ALL[random.random_range(0..Convention::ALL.len())];
    rig.robot.base = maybe(random, random_pose);
    rig.robot.link = maybe(random, |_| "base_link".to_owned());
    for index in 0..random.random_range(0..8) {
        let lower = maybe(random, random_number);
        rig.robot.joints.push(Joint {
            name: format!("joint {index}"),
            kind: JointKind::ALL[random.random_range(0..JointKind::ALL.len())],
            offset: maybe(random, random_number),
            d: maybe(random, random_number),
            a: maybe(random, random_number),
            alpha: maybe(random, random_number),
            beta: maybe(random, random_number),
            reversed: random.random_bool(0.3),
            limits: Limits {
                lower,
                upper: maybe(random, |r| lower.unwrap_or(0.0) + r.random_range(0.0..3.0)),
                velocity: maybe(random, |r| r.random_range(0.1..3.0)),
                acceleration: maybe(random, |r| r.random_range(0.1..30.0)),
            },
            link: maybe(random, |r| {
                if r.random_bool(0.3) { "joint 1".to_owned() } else { format!("link {}", r.random_range(0..9)) }
            }),
            frame: None,
        });
        let joint = rig.robot.joints.last_mut().unwrap();
        if [joint.offset, joint.d, joint.a, joint.alpha].iter().all(Option::is_some) {
            joint.frame = maybe(random, random_pose);
        }
    }
    // `start` is the nominal pose of a chain whose rows are all known
    let is_known = |joint: &Joint| [joint.offset, joint.d, joint.a, joint.alpha].iter().all(Option::is_some);
    if rig.robot.joints.iter().all(is_known) {
        rig.robot.start = maybe(random, random_pose);
    }
    let n_joints = rig.robot.joints.len();
    let parent = |random: &mut ChaCha8Rng| match random.random_range(0..3) {
        0 if n_joints > 0 => Parent::Link(random.random_range(0..n_joints)),
        1 => Parent::Tip,
        _ => Parent::World,
    };
    for index in 0..random.random_range(0..4) {
        let model = maybe(random, |r| CameraModel::ALL[r.random_range(0..CameraModel::ALL.len())]);
        let n_coefficients = model.map_or(8, |model| model.distortion().len());
        rig.cameras.push(Camera {
            name: format!("käm-{index}"),
            size: maybe(random, |r| [r.random_range(1..5000), r.random_range(1..5000)]),
            model,
            fx: maybe(random, |r| r.random_range(1.0..2000.0)),
            fy: maybe(random, |r| r.random_range(1.0..2000.0)),
            cx: maybe(random, random_number),
            cy: maybe(random, random_number),
            distortion: maybe(random, |r| (0..r.random_range(0..=n_coefficients)).map(|_| random_number(r)).collect()),
            depth: random.random_bool(0.3),
            parent: parent(random),
            pose: maybe(random, random_pose),
        });
    }
    for index in 0..random.random_range(0..6) {
        rig.features.push(Feature {
            name: format!("f{index}"),
            parent: parent(random),
            xyz: maybe(random, |r| std::array::from_fn(|_| random_number(r))),
        });
    }
    for index in 0..random.random_range(0..3) {
        rig.targets.push(Target {
            name: format!("tag {index}"),
            parent: parent(random),
            pose: maybe(random, random_pose),
        });
    }
    if random.random_bool(0.7) {
        rig.noise = Noise {
            pixels: random.random_range(0.0..2.0),
            points: random.random_range(0.0..0.1),
            joints: random.random_range(0.0..1e-6),
            pose: PoseNoise { xyz: random.random_range(0.0..0.1), rot: 0.0 },
            target: maybe(random, |r| PoseNoise { xyz: r.random_range(1e-6..0.1), rot: r.random_range(1e-6..0.1) }),
            joint_action: 0.0,
            pose_action: PoseNoise { xyz: 0.0, rot: random.random_range(0.0..0.1) },
        };
    }
    let free: Vec<Parameter> = rig.parameters();
    for parameter in free {
        let path = parameter.path(&rig);
        if rig.has_value(&parameter) && random.random_bool(0.2) {
            rig.estimate.fixed.push(path);
        } else if random.random_bool(0.2) {
            rig.estimate.prior.insert(path, random.random_range(1e-9..10.0));
        }
    }
    let joints = rig.robot.joints.clone();
    rig.fit = maybe(random, |r| Fit {
        samples: r.random_range(0..1000),
        observations: r.random_range(0..100_000),
        rejected: r.random_range(0..10),
        rms_px: r.random_range(0.0..1.0),
        mean_px: r.random_range(0.0..1.0),
        rms_points_m: maybe(r, |r| r.random_range(0.0..0.1)),
        gauge: (0..r.random_range(0..3)).map(|i| format!("the world's frame, {i}")).collect(),
        joints: joints.iter().map(|_| [r.random_range(-3.0..0.0), r.random_range(0.0..3.0)]).collect(),
        sd: [("robot.base".to_owned(), (0..6).map(|_| r.random_range(0.0..1.0)).collect())].into(),
    });
    rig
}

/// Equal but for the rounding of rotations.
fn assert_same(found: &Rig, expected: &Rig, what: &str) {
    let mut found = found.clone();
    let poses_found = poses(&mut found);
    let mut expected_poses = expected.clone();
    let poses_expected = poses(&mut expected_poses);
    assert_eq!(poses_found.len(), poses_expected.len(), "{what}");
    for (found, expected) in poses_found.into_iter().zip(poses_expected) {
        assert_eq!(found.is_some(), expected.is_some(), "{what}");
        if let (Some(found), Some(expected)) = (found.as_mut(), expected) {
            let error = (found.rotation - expected.rotation).amax();
            assert!(error <= ROUNDING, "{what}: {error:e}");
            found.rotation = expected.rotation;
        }
    }
    assert_eq!(&found, expected, "{what}");
}

fn poses(rig: &mut Rig) -> Vec<&mut Option<Pose>> {
    let cameras = rig.cameras.iter_mut().map(|camera| &mut camera.pose);
    let targets = rig.targets.iter_mut().map(|target| &mut target.pose);
    let frames = rig.robot.joints.iter_mut().map(|joint| &mut joint.frame);
    [&mut rig.robot.base, &mut rig.robot.start].into_iter().chain(frames).chain(cameras).chain(targets).collect()
}

#[test]
fn a_rig_read_back_is_the_rig_written_and_writes_the_same_bytes() {
    let shipped = catalog::ALL.iter().map(|(name, _)| (catalog::rig(name).unwrap(), (*name).to_owned()));
    for (rig, what) in shipped.chain((0..100).map(|seed| (random_rig(seed), format!("seed {seed}")))) {
        let text = rig.to_toml();
        let back = Rig::parse(&text, "written.toml").unwrap_or_else(|error| panic!("{what}: {error}\n{text}"));
        assert_same(&back, &rig, &what);
        assert_eq!(back.to_toml(), text, "{what}");
        assert_eq!(back.update_toml(&text).unwrap(), text, "{what}: nothing changed, so nothing is rewritten");
        assert_eq!(Rig::parse(&text, "").unwrap(), back, "{what}: from a quaternion on, nothing is rounded any more");
    }
}

#[test]
fn any_rig_file_can_be_brought_to_any_rig() {
    for seed in 0..100 {
        let (before, after) = (random_rig(seed), random_rig(seed + 1000));
        let text = after.update_toml(&before.to_toml()).unwrap();
        let back = Rig::parse(&text, "updated.toml").unwrap_or_else(|error| panic!("{seed}: {error}\n{text}"));
        assert_same(&back, &after, &format!("seed {seed}"));
    }
}

#[test]
fn an_update_keeps_comments_order_and_format_of_everything_else() {
    let original = r#"# Our cell, measured in May.
cameras = []       # none yet

[noise]            # from the data sheet
pixels = 0.50

[robot]
base = { rpy = [0, 0, 1.5], xyz = [1, 2, 3] } # bolted down

[[robot.joints]]
# The worn one.
alpha = 1.570
name = "a"
d = 0.30           # by ruler
limits.lower = -1
limits.upper = +1

[[robot.joints]]
name = "b"
d = 1_000.0
# The end.
"#;
    let mut rig = Rig::parse(original, "cell.toml").unwrap();
    assert_eq!(rig.update_toml(original).unwrap(), original);

    rig.robot.joints[0].d = Some(0.3125);
    rig.robot.joints[0].a = Some(1e-9);
    rig.robot.joints[0].limits.upper = Some(2.5);
    rig.robot.base.as_mut().unwrap().translation.x = 1.25;
    rig.fit = Some(Fit { samples: 7, gauge: vec!["scale".into()], ..Fit::default() });
    let updated = rig.update_toml(original).unwrap();
    let expected = original
        .replace("0.30           # by ruler", "0.3125           # by ruler")
        .replace("limits.upper = +1\n", "limits.upper = 2.5\na = 1e-9\n")
        .replace("xyz = [1, 2, 3]", "xyz = [1.25, 2.0, 3.0]");
    assert!(updated.starts_with(&expected), "{updated}");
    let added = &updated[expected.len()..];
    assert!(added.contains("[fit]\nsamples = 7\n") && added.contains("gauge = [\"scale\"]"), "{added}");
    assert_eq!(Rig::parse(&updated, "cell.toml").unwrap(), rig);

    // A new rotation is written as a quaternion, and a new camera in the list as the author began it.
    rig.robot.base = Some(Pose::identity());
    rig.cameras.push(Camera { name: "left".into(), fx: Some(600.0), ..Camera::default() });
    let updated = rig.update_toml(original).unwrap();
    assert!(
        updated.contains("base = { xyz = [0.0, 0.0, 0.0], quat = [0.0, 0.0, 0.0, 1.0] } # bolted down"),
        "{updated}"
    );
    assert!(
        updated.contains("cameras = [{ name = \"left\", fx = 600.0, parent = \"world\" }]       # none yet"),
        "{updated}"
    );
    assert_same(&Rig::parse(&updated, "cell.toml").unwrap(), &rig, "with a camera");
}

#[test]
fn joints_that_change_places_take_their_tables_and_comments_along() {
    let original = "[[robot.joints]]\nname = \"a\" # first\n[[cameras]]\nname = \"c\"\n[cameras.pose] # there\nxyz = [0, 0, 1]\n\
                    rpy = [0, 0, 0]\n[[robot.joints]]\nname = \"b\" # second\n[robot.joints.limits]\nlower = 0\n";
    let mut rig = Rig::parse(original, "x").unwrap();
    rig.robot.joints.swap(0, 1);
    rig.robot.joints.push(Joint { name: "c".into(), d: Some(1.0), ..Joint::default() });
    let updated = rig.update_toml(original).unwrap();
    assert_eq!(Rig::parse(&updated, "x").unwrap(), rig, "{updated}");
    for comment in ["\"a\" # first", "\"b\" # second", "[cameras.pose] # there"] {
        assert!(updated.contains(comment), "{updated}");
    }
}

#[test]
fn a_rig_may_be_written_in_every_style_of_toml() {
    let plain = Rig::parse(
        "[[robot.joints]]\nname = \"j\"\noffset = 1.0\nlimits = { lower = -1.0, upper = 2.0 }\n[[cameras]]\nname = \"c\"\n\
         pose = { xyz = [1.0, 2.0, 3.0], quat = [0.0, 0.0, 0.0, 1.0] }\n[estimate]\nfixed = [\"robot.joints.*.offset\"]\n\
         [estimate.prior]\n\"cameras.c.fx\" = 10.0\n[fit]\nsamples = 3\ngauge = [\"scale\"]\n[fit.sd]\n\"robot.joints.j.offset\" = 0.5\n",
        "plain",
    )
    .unwrap();
    for text in [
        "robot = { joints = [{ name = 'j', offset = 1, limits.lower = -1, limits.upper = 2 }] }\n\
         cameras = [{ name = \"c\", pose = { xyz = [1, 2, 3], quat = [0, 0, 0, 2] } }]\n\
         estimate.fixed = [\"robot.joints.*.offset\"]\nestimate.prior.cameras.c.fx = 10\n\
         fit = { samples = 3, gauge = \"scale\", sd.robot.joints.j.offset = 0.5 }",
        "fit.samples = 3\nfit.gauge = 'scale'\nfit.sd.\"robot.joints.j.offset\" = [0.5]\n\
         [estimate]\nprior = { 'cameras.c.fx' = 1e1 }\nfixed = ['robot.joints.*.offset']\n\
         [[cameras]]\npose.rpy = [0, 0, 0]\npose.xyz = [1, 2, 3]\nname = 'c'\n\
         [[robot.joints]]\nname = 'j'\noffset = 1\n[robot.joints.limits]\nlower = -1\nupper = 2\n[robot]\nconvention = 'dh'\n",
    ] {
        let rig = Rig::parse(text, "styled").unwrap();
        assert_eq!(rig, plain, "{text}");
        // And each of them can be updated in place.
        let mut changed = rig.clone();
        changed.robot.joints[0].limits.upper = Some(3.0);
        changed.robot.joints.push(Joint { name: "k".into(), offset: Some(2.0), ..Joint::default() });
        changed.cameras[0].pose.as_mut().unwrap().translation.z = 4.0;
        changed.noise.pixels = 0.25;
        changed.estimate.prior.insert("robot.base".into(), 0.1);
        changed.fit.as_mut().unwrap().samples = 4;
        let updated = changed.update_toml(text).unwrap();
        assert_eq!(Rig::parse(&updated, "styled").unwrap(), changed, "{updated}");
    }
}

#[test]
fn an_empty_rig_is_valid_and_may_hold_what_only_the_recording_names() {
    assert_eq!(Rig::parse("", "empty.toml").unwrap(), Rig::default());
    let rig = Rig::parse("[estimate]\nfixed = ['cameras.*.fx', 'robot.joints.elbow.a', 'features']\n", "x").unwrap();
    assert_eq!(rig.estimate.fixed.len(), 3);
}

#[test]
fn roll_pitch_yaw_are_those_of_urdf() {
    let rig =
        Rig::parse("robot.base = { xyz = [0, 0, 0], rpy = [1.5707963267948966, 0, 1.5707963267948966] }", "x").unwrap();
    // First a quarter turn about x, then about the fixed z: y goes to z and stays, z to -y and on to x.
    let base = rig.robot.base.unwrap();
    assert!((base.transform(&Vector3::y()) - Vector3::z()).amax() < 1e-15);
    assert!((base.transform(&Vector3::z()) - Vector3::x()).amax() < 1e-15);
}

#[test]
fn a_file_written_over_another_is_whole_and_keeps_its_comments() {
    let folder = std::env::temp_dir().join(format!("handeye-rig-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("rig.toml");
    std::fs::write(&path, "# mine\nname = \"old\"\n").unwrap();
    let (mut rig, text) = Rig::read_with_text(&path).unwrap();
    rig.name = Some("new".into());
    rig.write(&path, Some(&text)).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "# mine\nname = \"new\"\n");
    assert!(rig.write(&path, Some("not [ toml")).unwrap_err().is_input());
    assert_eq!(Rig::read(&path).unwrap(), rig, "a failed write leaves the file as it was");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_shipped_rigs_have_the_joints_of_their_arms() {
    let joints = [
        ("ur5", 6),
        ("ur5_arm", 6),
        ("ur5e", 6),
        ("ur3e", 6),
        ("ur10", 6),
        ("ur10e", 6),
        ("iiwa14", 7),
        ("puma560", 6),
        ("wam4", 4),
        ("wam7", 7),
        ("panda", 7),
        ("jaco", 6),
        ("baxter_left", 7),
        ("scara", 4),
    ];
    assert_eq!(catalog::ALL.len(), joints.len());
    for (name, n_joints) in joints {
        let rig = catalog::rig(name).unwrap();
        assert_eq!(rig.robot.joints.len(), n_joints, "{name}");
        for parameter in rig.parameters() {
            assert!(parameter == Parameter::Base || rig.has_value(&parameter), "{name}: {}", parameter.path(&rig));
        }
    }
    assert_eq!(catalog::rig("ur5").unwrap().cameras.len(), 2);
    assert_eq!(catalog::rig("ur5").unwrap().features.len(), 12);
    let message = catalog::rig("pandas").unwrap_err().to_string();
    assert_eq!(message, "no shipped rig is called `pandas` (did you mean `panda`?)");
}
