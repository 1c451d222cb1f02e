//! Pose graphs: rings of poses with loop closures, brought back to the truth that made them.
use handeye_solvers::linear::{Dense, LinearSolver};
use handeye_solvers::manifold::so3;
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{Factor, GaussNewton, Graph, Key, LevenbergMarquardt, Pose, Scalar, Solver, Vector, check};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

/// How one pose moves to the next: log of (measured⁻¹ a⁻¹ b).
struct Between(Pose);
impl Factor<6> for Between {
    type On = (Pose, Pose);
    fn residual<T: Scalar>(&self, (world_from_a, world_from_b): (Pose<T>, Pose<T>)) -> [T; 6] {
        let error = self.0.inverse().lift() * world_from_a.inverse() * world_from_b;
        let w = so3::log(&error.rotation);
        [w.x, w.y, w.z, error.translation.x, error.translation.y, error.translation.z]
    }
}

/// The same in the plane, on (x, y, heading).
struct PlanarBetween([f64; 3]);
impl Factor<3> for PlanarBetween {
    type On = (Vector<3>, Vector<3>);
    fn residual<T: Scalar>(&self, (a, b): (Vector<3, T>, Vector<3, T>)) -> [T; 3] {
        let (sin, cos) = (a.z.sin(), a.z.cos());
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        [cos * dx + sin * dy - self.0[0], cos * dy - sin * dx - self.0[1], b.z - a.z - self.0[2]]
    }
}

/// The sum of 12 uniform numbers, which has variance 1.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random_range(-0.5..0.5)).sum()
}

const STEPS: usize = 150;
const SIGMA: f64 = 0.005;

/// A helix-like ring of 3D poses with noisy steps and chords, started from the noisy steps alone.
fn ring(noise: f64) -> (Graph, Vec<Key<Pose>>, Vec<Pose>) {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let truth: Vec<Pose> = (0..STEPS)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / STEPS as f64;
            let at = Vector3::new(5.0 * angle.cos(), 5.0 * angle.sin(), (3.0 * angle).sin());
            Pose::new(Vector3::new(0.3 * angle.sin(), 0.4 * (2.0 * angle).cos(), angle - 3.0), at)
        })
        .collect();
    let mut measure = |a: &Pose, b: &Pose| {
        let mut vector =
            || Vector3::new(normal(&mut random), normal(&mut random), normal(&mut random)) * (SIGMA * noise);
        let disturbance = Pose::new(vector(), vector());
        a.inverse() * *b * disturbance
    };
    let mut graph = Graph::new();
    let mut keys = vec![graph.held(truth[0])];
    let mut at = truth[0];
    for i in 1..STEPS {
        let step = measure(&truth[i - 1], &truth[i]);
        // Dead reckoning, with a drift of its own: a degree and a centimetre per step.
        at = at * step * Pose::new(Vector3::new(0.0, 0.005, 0.01), Vector3::new(0.01, 0.0, 0.0));
        keys.push(graph.free(at));
        graph.factor(Between(step), (keys[i - 1], keys[i])).sigma(SIGMA);
    }
    for (i, j) in [(STEPS - 1, 0), (20, 95), (50, 130), (10, 70)] {
        graph.factor(Between(measure(&truth[i], &truth[j])), (keys[i], keys[j])).sigma(SIGMA);
    }
    (graph, keys, truth)
}

#[test]
fn a_ring_in_space_closes_on_the_truth() {
    let (mut graph, keys, truth) = ring(0.0);
    let mut solver = Solver::new(&graph);
    assert_eq!(solver.linear_solver(), "sparse Cholesky");
    let report = LevenbergMarquardt::default()
        .minimize_with(&mut graph, &mut solver, &mut |_| ControlFlow::Continue(()))
        .unwrap();
    assert!(report.termination.converged() && report.final_cost < 1e-9, "{report:?}");
    for (key, truth) in keys.iter().zip(&truth) {
        let found = graph.value(*key);
        assert!(found.angle_to(truth) < 1e-7 && (found.translation - truth.translation).norm() < 1e-7);
    }
}

#[test]
fn noise_leaves_a_cost_of_its_degrees_of_freedom() {
    // 2 cost is χ² with 6 (measurements - free poses) degrees of freedom: mean 24, σ = √48.
    let (mut graph, ..) = ring(1.0);
    let report = LevenbergMarquardt::default().minimize(&mut graph).unwrap();
    let freedoms = 6.0 * 4.0;
    assert!((2.0 * report.final_cost - freedoms).abs() < 3.0 * (2.0f64 * freedoms).sqrt(), "{report:?}");
}

#[test]
fn gauss_newton_and_a_dense_solver_find_the_same_ring() {
    let (mut a, keys, _) = ring(1.0);
    let (mut b, ..) = ring(1.0);
    LevenbergMarquardt::default().minimize(&mut a).unwrap();
    let mut dense = Solver::with(&b, |workspace| Box::new(Dense::new(workspace)) as Box<dyn LinearSolver>);
    GaussNewton::default().minimize_with(&mut b, &mut dense, &mut |_| ControlFlow::Continue(())).unwrap();
    for key in keys {
        let (a, b) = (a.value(key), b.value(key));
        assert!(a.angle_to(&b) < 1e-6 && (a.translation - b.translation).norm() < 1e-6);
    }
}

#[test]
fn a_square_in_the_plane_closes_on_the_truth() {
    let mut graph = Graph::new();
    let corner = |i: usize| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][i];
    let heading = |i: usize| std::f64::consts::FRAC_PI_2 * i as f64;
    let first = graph.held(Vector::<3>::zeros());
    let mut keys = vec![first];
    for i in 1..4 {
        let [x, y] = corner(i);
        keys.push(graph.free(Vector::<3>::new(x + 0.2, y - 0.3, heading(i) + 0.4)));
        graph.factor(PlanarBetween([1.0, 0.0, heading(1)]), (keys[i - 1], keys[i])).sigma(0.1);
    }
    graph.factor(PlanarBetween([1.0, 0.0, -3.0 * heading(1)]), (keys[3], first)).sigma(0.1);
    check::graph(&graph).unwrap();
    LevenbergMarquardt::default().minimize(&mut graph).unwrap();
    for (i, key) in keys.into_iter().enumerate() {
        let [x, y] = corner(i);
        assert!((graph.value(key) - Vector::<3>::new(x, y, heading(i))).norm() < 1e-9);
    }
}

#[test]
fn between_has_the_jacobian_of_its_residual() {
    let pose = |s: f64| Pose::new(Vector3::new(0.2, s, -0.4), Vector3::new(s, 1.0, -s));
    check::factor(&Between(pose(0.3)), &(pose(0.5), pose(-0.8))).unwrap();
}
