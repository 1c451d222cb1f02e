//! Distances that were measured give a rig that is learned from pixels alone its scale, and are told where they contradict what is known.
use crate::cli::Folder;
use crate::learning::{learn, nothing, record};
use handeye::calibrate::{Finding, Report};
use handeye::rig::{Ends, Feature, Length, Parent, Rig, catalog};
use handeye::simulate::random_rig;
use nalgebra::Vector3;

fn ends(kind: fn([String; 2]) -> Ends, names: [&str; 2]) -> Ends {
    kind(names.map(str::to_owned))
}

/// How far the ends are apart in a rig [m].
fn distance(rig: &Rig, between: &Ends) -> f64 {
    let place = |name: &String| match between {
        Ends::Features(_) => Vector3::from(rig.features.iter().find(|one| one.name == *name).unwrap().xyz.unwrap()),
        Ends::Cameras(_) => rig.cameras.iter().find(|one| one.name == *name).unwrap().pose.unwrap().translation,
    };
    let (_, [one, other]) = between.parts();
    (place(one) - place(other)).norm()
}

fn measured(truth: &Rig, between: Ends, off: f64, sd: f64) -> Length {
    Length { length: distance(truth, &between) + off, between, sd }
}

/// Learned from pixels and joints, and from these lengths.
fn learned_with(truth: &Rig, lengths: Vec<Length>, seed: u64) -> (Rig, Report) {
    let mut rig = nothing(truth);
    rig.estimate.lengths = lengths;
    let learned = learn(&rig, &record(truth, 40, seed)).unwrap();
    (learned.rig, learned.report)
}

#[test]
fn one_measured_length_makes_everything_metric_from_nothing() {
    for seed in 0..6 {
        let truth = random_rig(6, 2, 12, seed);
        let without = learned_with(&truth, Vec::new(), seed).1;
        assert!(
            !without.tip.unwrap().metric && without.gauge.iter().any(|line| line.starts_with("lengths are in units"))
        );
        let camera = |index: usize| truth.cameras[index].name.as_str();
        let feature = |index: usize| truth.features[index].name.as_str();
        let baseline = ends(Ends::Cameras, [camera(0), camera(1)]);
        let edge = ends(Ends::Features, [feature(0), feature(7)]);
        for (given, other) in [(&edge, &baseline), (&baseline, &edge)] {
            let (rig, report) = learned_with(&truth, vec![measured(&truth, given.clone(), 0.0, 1e-4)], seed);
            let tip = report.tip.unwrap();
            assert!(tip.metric && report.findings.is_empty(), "{tip:?} {:?}", report.findings);
            assert!(!report.gauge.iter().any(|line| line.contains("in units of")), "{:?}", report.gauge);
            let off = |ends: &Ends| (distance(&rig, ends) / distance(&truth, ends) - 1.0).abs();
            // The shape alone, as pixels tell it, and the scale to a tenth of a millimetre of what was measured.
            assert!(off(given) < 1e-4 / distance(&truth, given), "{seed} {given}: {}", off(given));
            assert!(off(other) < 0.01, "{seed} {given} {other}: {}", off(other));
        }
    }
}

/// Errors of a length that is measured badly go into the standard deviation of the tip: scale alone moves it.
#[test]
fn the_deviation_of_the_tip_tells_how_well_the_length_was_measured() {
    let truth = random_rig(6, 2, 12, 2);
    let edge = ends(Ends::Features, [&truth.features[0].name, &truth.features[7].name]);
    let share = 0.02;
    let sd = share * distance(&truth, &edge);
    let (rig, report) = learned_with(&truth, vec![measured(&truth, edge.clone(), 0.0, sd)], 2);
    let (_, exact) = learned_with(&truth, vec![measured(&truth, edge, 0.0, 1e-6)], 2);
    let [rough, exact] = [report, exact].map(|report| report.tip.unwrap().median);
    // By the scale, every point moves by a share of its distance from the origin of the world.
    let reach = rig.robot.joints.iter().map(|joint| joint.a.unwrap().abs() + joint.d.unwrap().abs()).sum::<f64>();
    println!("tip {:.2} mm, {:.2} mm with an exact length, reach {reach:.2} m", 1e3 * rough, 1e3 * exact);
    let of_scale = (rough * rough - exact * exact).sqrt();
    assert!(of_scale > 0.2 * share * reach && of_scale < share * reach, "{of_scale} {share} {reach}");
}

#[test]
fn a_length_that_contradicts_what_is_known_is_told() {
    let truth = random_rig(6, 2, 12, 3);
    let [edge, other] =
        [[0, 7], [1, 5]].map(|[i, k]| ends(Ends::Features, [&truth.features[i].name, &truth.features[k].name]));
    let right = measured(&truth, edge.clone(), 0.0, 1e-4);
    let wrong = measured(&truth, other, 0.05, 5e-4);
    let (_, report) = learned_with(&truth, vec![right.clone(), wrong.clone()], 3);
    let told = |length: &Length| {
        let is_it = |finding: &Finding| matches!(finding, Finding::MissedLength { length: told, .. } if told == length);
        report.findings.iter().any(is_it)
    };
    // What is not believed tells nothing of how well the tip is known.
    let (_, alone) = learned_with(&truth, vec![right.clone()], 3);
    let [both, alone] = [&report, &alone].map(|report| report.tip.unwrap().median);
    assert!((both / alone - 1.0).abs() < 0.02, "{both} {alone}");
    assert!(told(&wrong) && !told(&right) && report.findings.len() == 1, "{:?}", report.findings);
}

/// Tags whose side is given tell how large everything is, by file and by option alike.
#[test]
fn the_side_of_tags_makes_everything_metric() {
    let folder = Folder::new("tag-side");
    let mut rig = catalog::rig("ur5").unwrap();
    let corners = [[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]];
    rig.features = (0..12)
        .map(|index| {
            let ([x, y], tag) = (corners[index % 4], index / 4);
            let (name, z) = (format!("tag36h11:{tag}/{}", index % 4), 0.05 + 0.04 * tag as f64);
            let xyz = if tag == 1 { [x, z, y] } else { [x, y, z] };
            Feature { name, parent: Parent::Tip, xyz: Some(xyz) }
        })
        .collect();
    folder.write("truth.toml", &rig.to_toml());
    folder.expect(0, "simulate truth.toml --samples 40 -o rec.jsonl");
    let (said, _) = folder.expect(0, "calibrate rec.jsonl --tag-side 0.06 -o learned.toml");
    assert!(!said.contains("nothing metric"), "{said}");
    let learned = Rig::parse(&folder.read("learned.toml"), "learned.toml").unwrap();
    assert_eq!(learned.estimate.tag_side, Some([0.06, Length::RULER]));
    let length = |rig: &Rig| rig.robot.joints[1].a.unwrap().abs();
    assert!((length(&learned) / length(&rig) - 1.0).abs() < 0.01, "{} of {}", length(&learned), length(&rig));
    folder.write("start.toml", "[estimate]\ntag_side = 0.06\n");
    folder.expect(0, "calibrate rec.jsonl --rig start.toml -o again.toml");
    let again = Rig::parse(&folder.read("again.toml"), "again.toml").unwrap();
    assert_eq!((again.robot, again.cameras), (learned.robot, learned.cameras));
    let edge = "tag36h11:0/0,tag36h11:0/1=0.06,0.0001";
    folder.expect(0, &format!("calibrate rec.jsonl --length {edge} -o by-length.toml"));
    let by_length = Rig::parse(&folder.read("by-length.toml"), "by-length.toml").unwrap();
    assert!((length(&by_length) / length(&rig) - 1.0).abs() < 0.02);
    // Said again, it is still one measurement.
    folder.expect(0, &format!("calibrate rec.jsonl --rig by-length.toml --length {edge} -o by-length.toml"));
    let again = Rig::parse(&folder.read("by-length.toml"), "by-length.toml").unwrap();
    assert_eq!(again.estimate.lengths, by_length.estimate.lengths);
    folder.expect(0, "simulate ur5 --samples 40 -o other.jsonl");
    let (_, complaint) = folder.expect(2, "calibrate other.jsonl --tag-side 0.06 -o none.toml");
    assert!(complaint.contains("no tag has its four corners"), "{complaint}");
    for wrong in [
        "--length f0,cameras.left=0.1",
        "--length f0=0.1",
        "--length f0,f1=-1",
        "--tag-side 0",
        "--tag-side 60",
        "--tag-side 0.06,0",
    ] {
        folder.expect(2, &format!("calibrate other.jsonl {wrong} -o none.toml"));
    }
}

/// A length that is wrong by a fifth moves an arm whose links are known far from them, which is told.
#[test]
fn an_arm_that_a_wrong_length_stretches_is_told() {
    let truth = catalog::rig("ur5").unwrap();
    let mut rig = Rig { robot: truth.robot.clone(), ..nothing(&truth) };
    let edge = ends(Ends::Features, [&truth.features[0].name, &truth.features[7].name]);
    let off = 0.2 * distance(&truth, &edge);
    let far = |rig: &Rig| {
        let findings = learn(rig, &record(&truth, 40, 1)).unwrap().report.findings;
        findings
            .into_iter()
            .find_map(|finding| if let Finding::FarFromGiven { values } = finding { Some(values) } else { None })
    };
    assert_eq!(far(&rig), None);
    rig.estimate.lengths = vec![measured(&truth, edge.clone(), 0.0, 1e-4)];
    assert_eq!(far(&rig), None);
    rig.estimate.lengths = vec![measured(&truth, edge, off, 1e-4)];
    let values = far(&rig).unwrap();
    let (path, [given, learned], sds) = &values[0];
    assert!(path == "robot.joints.shoulder_lift.a" || path == "robot.joints.elbow.a", "{path}");
    assert!((learned / given - 1.2).abs() < 0.05 && *sds > 5.0, "{given} {learned} {sds}");
}

#[test]
fn lengths_are_read_checked_and_written_with_what_was_learned() {
    let folder = Folder::new("lengths");
    folder.expect(0, "simulate ur5 --samples 40 -o rec.jsonl");
    folder.write(
        "rig.toml",
        "[[estimate.lengths]] # ruler\nbetween = [\"features.f0\", \"features.f1\"]\nlength = 0.1\n",
    );
    let (checked, _) = folder.expect(0, "check rig.toml");
    assert!(checked.contains("the distance between features `f0` and `f1`: 100.00 ± 0.50 mm"), "{checked}");
    folder.expect(0, "calibrate rec.jsonl --rig rig.toml -o learned.toml");
    let learned = folder.read("learned.toml");
    assert!(learned.contains("[[estimate.lengths]] # ruler"), "{learned}");
    let rig = Rig::parse(&learned, "learned.toml").unwrap();
    assert!((distance(&rig, &ends(Ends::Features, ["f0", "f1"])) - 0.1).abs() < 1e-6);
    assert_eq!(Rig::parse(&rig.to_toml(), "learned.toml").unwrap(), rig);
    let refused = [
        (
            "between = [\"features.f0\", \"cameras.left\"]\nlength = 1",
            "rig.toml:2:11: estimate.lengths: `between`: is between two",
        ),
        ("between = [\"features.f0\"]\nlength = 1", "rig.toml:2:11: estimate.lengths: `between`: has two ends"),
        ("between = [\"features.f0\", \"features.f0\"]\nlength = 1", "`features.f0` is at both ends"),
        ("between = [\"features.f0\", \"features.f1\"]\nlength = 0", "rig.toml:3:10: estimate.lengths: `length`"),
        ("between = [\"features.f0\", \"features.f1\"]", "has no `length`"),
        ("between = [\"features.f0\", \"features.f99\"]\nlength = 1", "there is no `features.f99`"),
        (
            "between = [\"features.f0\", \"features.f1\"]\nlength = 1\n[[features]]\nname = \"f0\"\n[[features]]\nname = \"f1\"\nparent = \"world\"",
            "are not fixed to the same thing",
        ),
    ];
    for (text, what) in refused {
        folder.write("rig.toml", &format!("[[estimate.lengths]]\n{text}\n"));
        let (_, complaint) = folder.expect(2, "calibrate rec.jsonl --rig rig.toml -o again.toml");
        assert!(complaint.contains(what), "{text}\n{complaint}");
    }
}
