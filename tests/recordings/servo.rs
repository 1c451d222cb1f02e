//! Servoing on the problems that ViSP was measured on: at its best, it takes 7 steps to 1 px.
use crate::shared;
use handeye::infer::Sighting;
use handeye::servo::{Arm, Configuration, ModelBased};
use servo_cases::Cases;

#[path = "../../benches/common/servo_cases.rs"]
mod servo_cases;

fn look(arm: &Arm, cases: &Cases, joints: &[f64]) -> Vec<Sighting> {
    let mut at = Configuration::default();
    arm.configure(joints, &mut at);
    let features = cases.rig.features.len();
    let all = (0..cases.rig.cameras.len()).flat_map(|camera| (0..features).map(move |feature| (camera, feature)));
    all.map(|(camera, feature)| Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature).unwrap() }).collect()
}

fn mean_error(seen: &[Sighting], goal: &[Sighting]) -> f64 {
    let distance = |(a, b): (&Sighting, &Sighting)| (a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1]);
    seen.iter().zip(goal).map(distance).sum::<f64>() / seen.len() as f64
}

/// How many of the pairs are within 0.01 px after so many commands, with motions of at most so much a joint [rad].
fn solved(cases: &Cases, commands: usize, most: impl Fn(&[f64], &[f64]) -> Option<f64>) -> usize {
    let mut solved = 0;
    for (start, target) in &cases.pairs {
        let mut rig = cases.rig.clone();
        let velocity = most(start, target);
        rig.robot.joints.iter_mut().for_each(|joint| joint.limits.velocity = velocity);
        let arm = Arm::new(&rig).unwrap();
        let mut servo = ModelBased::new(&rig).unwrap();
        let goal = look(&arm, cases, target);
        servo.aim(&goal);
        let mut joints = start.clone();
        for _ in 0..commands {
            let step = servo.step(&look(&arm, cases, &joints), &joints, &[], 1.0).unwrap();
            joints.iter_mut().zip(&step.motion).for_each(|(joint, motion)| *joint += motion);
        }
        solved += usize::from(mean_error(&look(&arm, cases, &joints), &goal) < 0.01);
    }
    solved
}

#[test]
fn a_true_rig_takes_one_command_and_three_where_two_are_the_fewest() {
    let Some(path) = shared("cases/servo_ur5.json") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    for set in ["mid", "eih"] {
        let cases = Cases::new(&text, set);
        assert_eq!(cases.pairs.len(), 100);
        assert_eq!(solved(&cases, 1, |_, _| None), 100, "{set}: one command without limits");
        let half = |start: &[f64], target: &[f64]| {
            let farthest = start.iter().zip(target).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            Some(0.51 * farthest)
        };
        assert_eq!(solved(&cases, 3, half), 100, "{set}: joint speeds that allow the motion in two commands");
    }
}
