//! What servoing without a rig promises: the same step and limits, from a Jacobian that is estimated on the way.
use handeye::rig::Limits;
use handeye::servo::{Bound, Constraint, JointBounds, LimitRows, MotionSolver, TaskRows};

#[test]
fn rows_that_come_from_no_rig_are_met_inside_their_bounds_and_limits() {
    // Two quantities, u = x + y and v = x - y; wanted are u = 3 before x = 5, with x at most 1.2 per step and y - x at most 0.3.
    let (mut bounds, mut limits) = (JointBounds::default(), LimitRows::default());
    let slow = Limits { velocity: Some(12.0), ..Limits::default() };
    bounds.update(&[slow, Limits::default()], &[0.0, 0.0], &[0.0, 0.0], 0.1);
    limits.clear(2);
    limits.begin(4);
    limits.push([-1.0, 1.0], 0.3, 10.0);
    let mut tasks = [TaskRows::default(), TaskRows::default()];
    tasks.iter_mut().for_each(|rows| rows.clear(2));
    tasks[0].push([1.0, 1.0], 3.0, 0.1);
    tasks[1].push([1.0, 0.0], 5.0, 1.0);
    let mut solver = MotionSolver::new(0.0);
    let step = solver.solve(&tasks, &limits, &bounds);
    // The limit keeps y at x + 0.3 or less, so that u is at most 2 x + 0.3 = 2.7.
    assert!((step.motion[0] - 1.2).abs() < 1e-6 && (step.motion[1] - 1.5).abs() < 1e-6, "{step:?}");
    let held: Vec<Constraint> = step.active.iter().map(|active| active.constraint).collect();
    assert!(held.contains(&Constraint::Joint { joint: 0, bound: Bound::Velocity, upper: true }), "{held:?}");
    assert!(held.contains(&Constraint::Limit { limit: 4, row: 0 }), "{held:?}");
    // Without tasks, what moves too fast to stop is still braked: from 10 at 1 m from its end, by 30 per second squared.
    let ends = Limits { upper: Some(1.0), acceleration: Some(30.0), ..Limits::default() };
    bounds.update(&[ends], &[0.0], &[10.0], 0.1);
    limits.clear(1);
    let step = solver.solve(&[], &limits, &bounds);
    assert!(step.motion[0] > 0.4 && !step.failed, "{step:?}");
    // What is not a number moves nothing.
    tasks[0].push([f64::NAN, 1.0], 1.0, 1.0);
    bounds.update(&[Limits::default(); 2], &[0.0; 2], &[0.0; 2], 0.1);
    limits.clear(2);
    let step = solver.solve(&tasks, &limits, &bounds);
    assert!(step.failed && step.motion == [0.0, 0.0], "{step:?}");
}
