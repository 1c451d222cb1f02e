//! A rig that began as a URDF is calibrated, and comes out as a URDF for the arm's other users.
use crate::cli::Folder;
use crate::urdf::{ARM, arm, distance, furthest, placed, positions, rig_of};
use handeye::calibrate::{Options, calibrate};
use handeye::export::to_urdf;
use handeye::rig::{Camera, Feature, Model, Parent, Rig};
use handeye::simulate::{SimulateOptions, simulate};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

/// The arm as another one of its make may be: every row off by up to 2 mm and 0.01 rad.
fn disturbed(rig: &Rig, seed: u64) -> Rig {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut rig = rig.clone();
    for joint in &mut rig.robot.joints {
        for (value, most) in [
            (&mut joint.offset, 0.01),
            (&mut joint.d, 0.002),
            (&mut joint.a, 0.002),
            (&mut joint.alpha, 0.01),
            (&mut joint.beta, 0.01),
        ] {
            *value = value.map(|value| value + random.random_range(-most..most));
        }
    }
    rig
}

#[test]
fn an_arm_that_was_not_calibrated_comes_out_with_the_same_bytes() {
    assert_eq!(to_urdf(&arm(), ARM, "arm.urdf").unwrap(), ARM);
}

#[test]
fn a_calibrated_arm_comes_out_in_its_joint_origins_and_everything_else_stays() {
    for seed in 0..20 {
        let rig = disturbed(&arm(), seed);
        let text = to_urdf(&rig, ARM, "arm.urdf").unwrap();
        let back = rig_of(&text, "base = \"base_link\"\ntip = \"tool0\"\n").unwrap();
        assert!(furthest(&rig, &back) < 1e-11, "{:e}", furthest(&rig, &back));
        // Without the origins of the joints that move there is no difference.
        let bare = |text: &str| {
            let origins = text.match_indices("<origin").filter(|(at, _)| {
                ["mount", "flange_joint", "tool_joint", "base_joint"]
                    .iter()
                    .all(|fixed| !text[..*at].rsplit("<joint").next().unwrap().contains(&format!("\"{fixed}\"")))
            });
            let mut bare = text.to_owned();
            for (at, _) in origins.collect::<Vec<_>>().into_iter().rev() {
                bare.replace_range(at..at + text[at..].find('>').unwrap() + 1, "");
            }
            bare.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        assert_eq!(bare(&text).replace("</origin>", ""), bare(ARM).replace("</origin>", ""));
        // Again out, with the rig as the file now has it.
        assert_eq!(to_urdf(&back, &text, "arm.urdf").unwrap(), text);
    }
}

/// The arm before two cameras, with features on its tool; its base stands in the world as it says.
fn rig_with_views() -> Rig {
    let mut rig = arm();
    rig.robot.base = Some(placed([0.1, -0.2, 0.3], [0.0, 0.0, 0.5]));
    let model = Model::new(&rig).unwrap();
    let middle = model.tip(&[0.0, -1.45, -1.35, 0.5, -1.5, 0.0]).translation;
    let looking = |from: Vector3<f64>| {
        let z = -from.normalize();
        let x = z.cross(&Vector3::z()).normalize();
        Some(Pose { rotation: nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]), translation: middle + from })
    };
    for (name, pose) in
        [("left", looking(Vector3::new(0.9, -1.2, 0.7))), ("right", looking(Vector3::new(1.1, 1.0, 0.5)))]
    {
        let (f, size) = (Some(600.0), Some([1280, 960]));
        rig.cameras.push(Camera {
            name: name.into(),
            size,
            fx: f,
            fy: f,
            cx: Some(639.5),
            cy: Some(479.5),
            pose,
            ..Camera::default()
        });
    }
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for index in 0..12 {
        let xyz = Some(std::array::from_fn(|_| random.random_range(-0.06..0.06)));
        rig.features.push(Feature { name: format!("f{index}"), parent: Parent::Tip, xyz });
    }
    rig.noise.pixels = 0.3;
    rig
}

#[test]
fn an_arm_that_is_not_quite_its_urdf_is_calibrated_and_its_urdf_then_says_where_it_is() {
    for seed in 0..5 {
        let nominal = rig_with_views();
        let truth = disturbed(&nominal, seed);
        let motions =
            |seed| simulate(&truth, &SimulateOptions { samples: 60, seed, ..SimulateOptions::default() }).unwrap();
        // Cameras and features are known, so that nothing but the arm is open.
        let mut start = nominal.clone();
        start.estimate.fixed = vec!["robot.base".into(), "cameras".into(), "features".into()];
        let learned =
            calibrate(&start, &motions(seed).recording, &Options::default(), &mut |_| ControlFlow::Continue(()));
        let learned = learned.unwrap().rig;

        let text = to_urdf(&learned, ARM, "arm.urdf").unwrap();
        let mut written = rig_of(&text, "base = \"base_link\"\ntip = \"tool0\"\n").unwrap();
        written.robot.base = nominal.robot.base;
        let fresh = motions(100 + seed).truth;
        let tip_error = |rig: &Rig| {
            let (found, truth) = (Model::new(rig).unwrap(), Model::new(&truth).unwrap());
            let distance = |q: &Vec<f64>| (found.tip(q).translation - truth.tip(q).translation).norm();
            let distances: Vec<f64> = fresh.samples.iter().filter_map(|s| s.joints.as_ref()).map(distance).collect();
            distances.iter().sum::<f64>() / distances.len() as f64
        };
        let (before, after) = (tip_error(&nominal), tip_error(&written));
        assert!(after < 0.0005 && before > 0.003, "seed {seed}: {before} m nominal, {after} m calibrated");
        assert!((after - tip_error(&learned)).abs() < 1e-9);
    }
}

#[test]
fn a_learned_rig_is_written_over_the_rig_file_with_rows_in_place_of_the_urdf() {
    let folder = Folder::new("urdf-update");
    let file = "# My arm.\n[robot]\nurdf = \"arm.urdf\" # from the maker\nbase = \"base_link\"\ntip = \"tool0\"\n\n\
                [[features]]\nname = \"f\" # a dot\nparent = \"forearm\"\n";
    folder.write("arm.urdf", ARM).write("rig.toml", file);
    let (mut rig, text) = Rig::read_with_text(&folder.path().join("rig.toml")).unwrap();
    assert_eq!(rig.features[0].parent, Parent::Link(2), "a link's name will do");
    rig.robot.joints[1].offset = Some(0.25);
    let updated = rig.update_toml(&text).unwrap();
    assert!(
        updated.starts_with("# My arm.\n[robot]\n") && updated.contains("\"f\" # a dot\nparent = \"forearm\""),
        "{updated}"
    );
    let back = Rig::parse(&updated, "elsewhere/rig.toml").unwrap();
    assert_eq!(back.robot.joints[1].offset, Some(0.25));
    assert!(furthest(&back, &rig) < 1e-13);
    // From the command line, and again from what it wrote.
    folder.expect(0, "export rig.toml --to dh -o rows.toml");
    folder.expect(0, "export rows.toml --to urdf --urdf arm.urdf -o same.urdf");
    assert_eq!(folder.read("same.urdf"), ARM);
    assert_eq!(folder.expect(0, "export rows.toml --to urdf --urdf arm.urdf").0, ARM);
}

#[test]
fn a_rig_that_is_no_arm_of_the_urdf_is_refused() {
    let ur5 = handeye::rig::catalog::rig("ur5").unwrap();
    let error = to_urdf(&ur5, ARM, "arm.urdf").unwrap_err();
    assert!(error.to_string().contains("does not say which links"), "{error}");
    let fewer = ARM.replace("name=\"bend\" type=\"revolute\"", "name=\"bend\" type=\"fixed\"");
    let error = to_urdf(&arm(), &fewer, "arm.urdf").unwrap_err();
    assert!(error.to_string().contains("pan, lift, elbow, roll, turn"), "{error}");
    let other_axis = ARM.replace("0.1 0.02 1", "0.1 0.03 1");
    let error = to_urdf(&arm(), &other_axis, "arm.urdf").unwrap_err();
    assert!(error.to_string().contains("joint `bend`"), "{error}");
}

#[test]
fn random_arms_with_axes_anywhere_are_read_and_written_exactly() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for case in 0..200 {
        let n = random.random_range(1..8);
        let mut text = "<robot name='r'><link name='l0'/>".to_owned();
        let mut steps = Vec::new();
        for i in 1..=n {
            // Often straight, often at right angles, sometimes nearly so.
            let mut number = |scale: f64| match random.random_range(0..4) {
                0 => 0.0,
                1 => (random.random_range(-2..3) as f64) * std::f64::consts::FRAC_PI_2,
                2 => random.random_range(-1e-7..1e-7),
                _ => random.random_range(-scale..scale),
            };
            let (xyz, rpy) = ([number(0.5), number(0.5), number(0.5)], [number(3.0), number(3.0), number(3.0)]);
            let mut axis = [number(1.0), number(1.0), number(1.0)];
            axis[i % 3] += if axis.iter().all(|v| v.abs() < 0.1) { 1.0 } else { 0.0 };
            let kind = ["revolute", "continuous", "prismatic"][random.random_range(0..3)];
            let list = |v: [f64; 3]| v.map(|x| x.to_string()).join(" ");
            text += &format!(
                "<link name='l{i}'/><joint name='j{i}' type='{kind}'><parent link='l{}'/><child link='l{i}'/><axis xyz='{}'/>\
                 <origin xyz='{}' rpy='{}'/></joint>\n",
                i - 1,
                list(axis),
                list(xyz),
                list(rpy)
            );
            steps.push((placed(xyz, rpy), Vector3::from(axis).normalize(), kind == "prismatic"));
        }
        text += "</robot>";
        let rig = rig_of(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let model = Model::new(&rig).unwrap();
        for q in positions(n, 20) {
            let mut at = Pose::identity();
            for ((origin, axis, slides), (q, found)) in steps.iter().zip(q.iter().zip(&model.links(&q)[1..])) {
                let motion = if *slides {
                    Pose { rotation: so3::exp(&Vector3::zeros()), translation: axis * *q }
                } else {
                    Pose { rotation: so3::exp(&(axis * *q)), translation: Vector3::zeros() }
                };
                at = at * *origin * motion;
                let far = 1.0 + at.translation.norm();
                assert!(distance(found, &at) < 1e-12 * far, "case {case}: {:e}\n{text}", distance(found, &at));
            }
        }
        assert_eq!(to_urdf(&rig, &text, "r").unwrap(), text, "case {case}");
        let off = disturbed(&rig, case);
        let back = rig_of(&to_urdf(&off, &text, "r").unwrap(), "").unwrap();
        assert!(furthest(&off, &back) < 1e-10, "case {case}: {:e}", furthest(&off, &back));
    }
}

#[test]
fn an_origin_that_is_put_in_repeats_nothing_of_the_file() {
    for between in
        ["\n    type=\"revolute\"><parent link=\"a\"/>", " type=\"revolute\">\n  <!-- c --><parent link=\"a\"/>"]
    {
        let text = format!(
            "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/>\n<joint name=\"j\"{between}<child link=\"b\"/>\
             <limit lower=\"-1\" upper=\"1\"/></joint></robot>"
        );
        let mut rig = rig_of(&text, "").unwrap();
        rig.robot.joints[0].d = Some(0.25);
        let out = to_urdf(&rig, &text, "r.urdf").unwrap();
        assert_eq!(
            out.matches("type=").count() + out.matches("<!--").count(),
            text.matches("type=").count() + text.matches("<!--").count()
        );
        let back = rig_of(&out, "").unwrap();
        assert!(furthest(&rig, &back) < 1e-12, "{out}");
    }
}
