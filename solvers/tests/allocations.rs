//! A minimiser allocates before its first iteration and after its last, and nowhere between.
use handeye_solvers::linear::{Dense, LinearSolver, Schur, Sparse};
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{Factor, Function, Graph, LevenbergMarquardt, Pose, Scalar, Solver, Vector, Workspace};
use std::ops::ControlFlow;

struct Reach;
impl Function for Reach {
    type On = (Pose, Vector<2>);
    type Output = Pose;
    fn compute<T: Scalar>(&self, (base, q): (Pose<T>, Vector<2, T>)) -> Pose<T> {
        let zero = T::zero();
        base * Pose {
            rotation: handeye_solvers::manifold::so3::exp(&Vector3::new(q.x, q.y, zero)),
            translation: Vector3::new(T::one(), q.x, q.y),
        }
    }
}

struct Sees([f64; 2]);
impl Factor<2> for Sees {
    type On = (Pose, Vector<3>);
    fn residual<T: Scalar>(&self, (tip, point): (Pose<T>, Vector<3, T>)) -> [T; 2] {
        let p = tip.inverse_transform(&point);
        [p.x - self.0[0], p.y - self.0[1]]
    }
}

/// Iterations that were made of at most so many, and how often they asked for memory.
fn iterations_and_allocations(
    max_iterations: usize,
    choose: impl FnOnce(&Workspace) -> Box<dyn LinearSolver>,
) -> (usize, u64) {
    let mut graph = Graph::new();
    let base = graph.free(Pose::new(Vector3::new(0.3, 0.1, -0.2), Vector3::zeros()));
    graph.prior(base, &Pose::identity(), &[0.1; 6]);
    let points = [0.0, 1.0, 2.0].map(|x| graph.free(Vector::<3>::new(x, 1.0 - x * x, 2.0)));
    for (i, &point) in points.iter().enumerate() {
        graph.prior(point, &Vector::<3>::new(i as f64, 0.0, 2.0), &[0.5; 3]);
    }
    for sample in 0..12 {
        let s = f64::from(sample);
        let joints = graph.free(Vector::<2>::new(0.1 * s, 0.5));
        graph.hold_coordinates(points[1], &[2]);
        let tip = graph.derive(Reach, (base, joints));
        for (i, &point) in points.iter().enumerate() {
            graph.factor(Sees([(s + i as f64).sin(), 0.4 * s.cos()]), (tip, point));
        }
    }
    let mut solver = Solver::with(&graph, choose);
    let settings = LevenbergMarquardt { max_iterations, initial_damping: 1e-3, ..LevenbergMarquardt::default() };
    let mut iterations = 0;
    let mut observer = |_: &_| {
        iterations += 1;
        ControlFlow::Continue(())
    };
    let asked = allocation_counter::measure(|| {
        settings.minimize_with(&mut graph, &mut solver, &mut observer).unwrap();
    });
    (iterations, asked.count_total)
}

#[test]
fn nothing_is_allocated_after_the_first_iteration() {
    type Choice = (&'static str, fn(&Workspace) -> Box<dyn LinearSolver>);
    let choices: [Choice; 3] = [
        ("dense", |workspace| Box::new(Dense::new(workspace))),
        ("Schur", |workspace| Box::new(Schur::new(workspace).expect("joints can be eliminated"))),
        ("sparse", |workspace| Box::new(Sparse::new(workspace))),
    ];
    for (name, choose) in choices {
        // What a thread sets up once is no iteration's.
        iterations_and_allocations(2, choose);
        let (few, asked_by_few) = iterations_and_allocations(2, choose);
        let (many, asked_by_many) = iterations_and_allocations(8, choose);
        assert!(many >= few + 3, "{name}: {few} and {many} iterations");
        assert_eq!(asked_by_few, asked_by_many, "{name}: {few} and {many} iterations");
    }
}
