//! L-BFGS reaches the optimum of Levenberg-Marquardt: in a valley, on manifolds, among derived nodes and by minibatches.
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{
    Factor, FactorKey, Function, Graph, Key, Lbfgs, LevenbergMarquardt, Minibatches, Pose, Scalar, Termination, Vector,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

struct Rosenbrock;
impl Factor<2> for Rosenbrock {
    type On = (Vector<2>,);
    fn residual<T: Scalar>(&self, (x,): (Vector<2, T>,)) -> [T; 2] {
        [(x.y - x.x * x.x) * 10.0, T::one() - x.x]
    }
}

#[test]
fn a_curved_valley_is_followed_to_its_end() {
    let mut graph = Graph::new();
    let xs: Vec<Key<Vector<2>>> =
        (0..20).map(|i| graph.free(Vector::<2>::new(-1.2 + 0.05 * f64::from(i), 1.0))).collect();
    for &x in &xs {
        graph.factor(Rosenbrock, (x,));
    }
    let report = Lbfgs::default().minimize(&mut graph).unwrap();
    assert!(report.termination.converged() && report.iterations < 500, "{report:?}");
    for x in xs {
        assert!((graph.value(x) - Vector::<2>::new(1.0, 1.0)).norm() < 1e-5);
    }
}

/// The tip of an arm whose last link turns by the sample's joint.
struct Tip(f64);
impl Function for Tip {
    type On = (Pose, Pose);
    type Output = Pose;
    fn compute<T: Scalar>(&self, (base, tool): (Pose<T>, Pose<T>)) -> Pose<T> {
        let joint = Pose::new(Vector3::new(self.0.sin(), self.0.cos(), self.0), Vector3::new(0.2 * self.0, 1.0, 0.0));
        base * joint.lift() * tool
    }
}

struct Sees([f64; 3]);
impl Factor<3> for Sees {
    type On = (Pose, Vector<3>);
    fn residual<T: Scalar>(&self, (tip, point): (Pose<T>, Vector<3, T>)) -> [T; 3] {
        let p = tip.transform(&point);
        std::array::from_fn(|i| p[i] - self.0[i])
    }
}

struct Arm {
    graph: Graph,
    base: Key<Pose>,
    tool: Key<Pose>,
    samples: Vec<Vec<FactorKey>>,
}

/// A base a radian and more from its start, a tool whose y is held, points known up to noise.
fn arm() -> Arm {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut graph = Graph::new();
    let truth = Pose::new(Vector3::new(0.7, -0.9, 0.8), Vector3::new(1.0, -2.0, 0.5));
    let tool = Pose::new(Vector3::new(0.1, 0.2, -0.3), Vector3::new(0.3, 0.1, 0.4));
    let base_key = graph.free(Pose::identity());
    let tool_key = graph.free(Pose::new(Vector3::zeros(), Vector3::new(0.0, tool.translation.y, 0.0)));
    graph.hold_coordinates(tool_key, &[4]);
    let points = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], [0.4, 0.4, 0.1]].map(Vector3::from);
    let keys = points.map(|point| graph.free(point + Vector3::new(0.02, -0.01, 0.03)));
    for (key, point) in keys.into_iter().zip(&points) {
        graph.prior(key, point, &[0.02; 3]);
    }
    let samples = (0..40)
        .map(|sample| {
            let function = Tip(0.15 * f64::from(sample));
            let tip = function.compute::<f64>((truth, tool));
            let node = graph.derive(function, (base_key, tool_key));
            points
                .iter()
                .zip(keys)
                .map(|(point, key)| {
                    let seen = tip.transform(point).map(|x| x + random.random_range(-0.01..0.01));
                    graph.factor(Sees(seen.into()), (node, key)).sigma(0.01).key
                })
                .collect()
        })
        .collect();
    Arm { graph, base: base_key, tool: tool_key, samples }
}

fn optimum() -> (Arm, f64) {
    let mut arm = arm();
    let report = LevenbergMarquardt { cost_tolerance: 1e-14, ..Default::default() }.minimize(&mut arm.graph).unwrap();
    (arm, report.final_cost)
}

fn assert_same(found: &Arm, expected: &Arm) {
    for key in [found.base, found.tool] {
        let (a, b) = (found.graph.value(key), expected.graph.value(key));
        assert!(a.angle_to(&b) < 1e-5 && (a.translation - b.translation).norm() < 1e-5, "{a:?} {b:?}");
    }
    assert_eq!(found.graph.value(found.tool).translation.y, 0.1, "what is held stays");
}

#[test]
fn poses_and_derived_nodes_reach_the_optimum_of_levenberg_marquardt() {
    let (expected, cost) = optimum();
    let mut found = arm();
    let report = Lbfgs::default().minimize(&mut found.graph).unwrap();
    assert!(report.termination.converged(), "{report:?}");
    assert!((report.final_cost / cost - 1.0).abs() < 1e-8, "{} {cost}", report.final_cost);
    assert_same(&found, &expected);
}

#[test]
fn random_minibatches_first_and_all_data_last_reach_it_too() {
    let (expected, cost) = optimum();
    let run = |seed: u64| {
        let mut found = arm();
        let groups = found.samples.clone();
        let minibatches = Minibatches { groups, size: 8, batches: 10, iterations_each: 5, seed };
        let report = Lbfgs::default()
            .minimize_with(&mut found.graph, Some(&minibatches), &mut |_| ControlFlow::Continue(()))
            .unwrap();
        assert!(report.termination.converged(), "{report:?}");
        assert!((report.final_cost / cost - 1.0).abs() < 1e-8, "{} {cost}", report.final_cost);
        assert_same(&found, &expected);
        (report, found.graph.value(found.base))
    };
    assert_eq!(run(1), run(1), "a seed decides everything");
    assert_ne!(run(1).0.iterations, 0);
    run(2);
}

#[test]
fn an_observer_cancels_and_keeps_the_best_values() {
    let mut found = arm();
    let mut seen = Vec::new();
    let report = Lbfgs::default()
        .minimize_with(&mut found.graph, None, &mut |iteration| {
            seen.push(iteration.cost);
            if iteration.number == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    assert_eq!((report.termination, report.iterations, seen.len()), (Termination::Cancelled, 5, 5));
    assert!((found.graph.cost() / seen[4] - 1.0).abs() < 1e-9 && seen[4] < report.initial_cost);
}
