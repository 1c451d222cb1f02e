//! A control loop does not wait for memory, and may run on any thread.
use crate::servo::{look, moved, positions};
use handeye::rig::catalog;
use handeye::servo::limits::{HalfSpace, InImage, TipSpeed};
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{Arm, Configuration, Goal, Limit, MotionSolver, Stepper};
use nalgebra::Vector3;

#[test]
fn steps_with_active_limits_ask_for_no_memory_after_the_first() {
    let rig = catalog::rig("ur5").unwrap();
    let arm = Arm::new(&rig).unwrap();
    let (mut active, mut conflicts) = (0, Vec::new());
    for places in positions(&rig, 20, 14).chunks_exact(2) {
        let task = ImagePoints { targets: look(&arm, &rig, &places[1]), seen: Vec::new(), sd: 1.0 };
        let image = InImage { camera: 0, features: (0..rig.features.len()).collect(), margin: 10.0, strength: 10.0 };
        let slow = TipSpeed { speed: 0.2, strength: 1.0 };
        let (mut joints, mut at, mut stepper) = (places[0].clone(), Configuration::default(), Stepper::default());
        arm.configure(&joints, &mut at);
        // Out of reach for so slow a tip: something has to give way at first.
        let height = at.posture.tip().translation.z + 0.02;
        let above = HalfSpace { normal: -Vector3::z(), offset: -height, strength: 10.0 };
        let (goals, limits): (_, [&dyn Limit; 3]) = ([Goal::new(&task)], [&image, &slow, &above]);
        for index in 0..200 {
            let (mut is_held, mut is_conflict) = (false, false);
            let more = allocation_counter::measure(|| {
                arm.configure(&joints, &mut at);
                let step = stepper.step(&arm, &at, &goals, &limits, 0.01);
                (is_held, is_conflict) = (!step.active.is_empty(), !step.conflict.is_empty());
                moved(&mut joints, &step.motion);
            });
            let more = more.count_total;
            if !is_conflict {
                assert!(index == 0 || more == 0, "step {index} asked for memory {more} times");
                active += usize::from(is_held);
            } else if index > 0 {
                conflicts.push(more);
            }
        }
    }
    assert!(active > 500 && conflicts.len() > 20, "{active} steps with active limits, {} conflicts", conflicts.len());
    // Where rows give way, Clarabel is set up once for every number of rows within reach, and asks once in every solve.
    conflicts.sort_unstable();
    assert!(conflicts[conflicts.len() / 2] <= 1, "{conflicts:?}");
}

#[test]
fn steppers_can_be_sent_to_the_thread_of_a_loop() {
    fn is_send<T: Send>() {}
    is_send::<Stepper>();
    is_send::<MotionSolver>();
}
