//! Linearising and solving: every layout of nodes and factors gives the normal equations of its residuals.
use handeye_solvers::linear::{Dense, LinearSolver, Schur, Sparse};
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{
    Factor, Function, Graph, Key, LevenbergMarquardt, Loss, Pose, Scalar, Solver, Termination, Vector, Workspace, check,
};
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

struct Compose;
impl Function for Compose {
    type On = (Pose, Pose);
    type Output = Pose;
    fn compute<T: Scalar>(&self, (a, b): (Pose<T>, Pose<T>)) -> Pose<T> {
        a * b
    }
}

/// A joint turns and lifts its child.
struct Joint;
impl Function for Joint {
    type On = (Pose, Vector<2>);
    type Output = Pose;
    fn compute<T: Scalar>(&self, (parent, q): (Pose<T>, Vector<2, T>)) -> Pose<T> {
        let zero = T::zero();
        let turn = handeye_solvers::manifold::so3::exp(&Vector3::new(zero, q.x * 0.3, q.x));
        parent * Pose { rotation: turn, translation: Vector3::new(zero, q.x * q.y, q.y) }
    }
}

struct Place;
impl Function for Place {
    type On = (Pose, Vector<3>);
    type Output = Vector<3>;
    fn compute<T: Scalar>(&self, (pose, point): (Pose<T>, Vector<3, T>)) -> Vector<3, T> {
        pose.transform(&point)
    }
}

/// A nonlinear residual on two poses and a point.
struct Sees(f64);
impl Factor<2> for Sees {
    type On = (Pose, Pose, Vector<3>);
    fn residual<T: Scalar>(&self, (a, b, p): (Pose<T>, Pose<T>, Vector<3, T>)) -> [T; 2] {
        let q = b.inverse_transform(&a.transform(&p));
        [q.x / (q.z * q.z + 3.0) - self.0, q.y / (q.z * q.z + 3.0) + q.x * self.0]
    }
}

struct Near([f64; 3]);
impl Factor<3> for Near {
    type On = (Vector<3>, Vector<3>);
    fn residual<T: Scalar>(&self, (a, b): (Vector<3, T>, Vector<3, T>)) -> [T; 3] {
        std::array::from_fn(|i| a[i] * b[(i + 1) % 3] - b[i] - self.0[i])
    }
}

struct Bound(f64);
impl Factor<1> for Bound {
    type On = (Vector<2>, Vector<2>);
    fn residual<T: Scalar>(&self, (a, b): (Vector<2, T>, Vector<2, T>)) -> [T; 1] {
        [a.x * b.y - (a.y + b.x).sin() - self.0]
    }
}

/// `samples` chains on shared poses and points, with factors of every kind on them.
fn chains(samples: usize, repeats: usize, seed: u64) -> Graph {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut number = move || random.random_range(-1.0..1.0);
    let mut graph = Graph::new();
    let mut pose = |s: f64| {
        let mut v = || Vector3::new(number(), number(), number()) * s;
        Pose::new(v(), v())
    };
    let base = graph.free(pose(1.0));
    let camera = graph.free(pose(1.0));
    let held = graph.held(pose(1.0));
    graph.hold_coordinates(camera, &[1, 5]);
    let points: Vec<Key<Vector<3>>> = (0..3).map(|i| graph.free(pose(1.0).translation * (1.0 + i as f64))).collect();
    graph.hold_coordinates(points[1], &[0]);
    let constant = graph.derive(Compose, (held, held));
    let twice = graph.derive(Compose, (base, base));
    for sample in 0..samples {
        let numbers = pose(1.0).translation;
        let joints = graph.free(Vector::<2>::new(numbers.x, numbers.y));
        let first = graph.derive(Joint, (base, joints));
        // A parent and a grandparent, in falling order; then a chain through a constant.
        let second = graph.derive(Joint, (first, joints));
        let tip = graph.derive(Compose, (second, constant));
        let point = graph.derive(Place, (tip, points[sample % 3]));
        for repeat in 0..repeats {
            let s = 0.1 * (sample + repeat) as f64;
            let near = Near([s.sin(), s.cos(), 0.3]);
            match repeat % 9 {
                0 => drop(graph.factor(Sees(0.2), (tip, camera, points[0])).sigma(0.5)),
                1 => drop(graph.factor(Sees(0.3), (second, first, points[1])).sigmas([0.5, 2.0])),
                2 => drop(graph.factor(Sees(-0.1), (first, base, points[2])).whitening([[1.0, 0.3], [0.0, 2.0]])),
                3 => drop(graph.factor(near, (point, point))),
                4 => drop(graph.factor(near, (point, points[sample % 3]))),
                5 => drop(graph.factor(Sees(0.4), (held, tip, points[0])).loss(Loss::Cauchy(0.7))),
                6 => drop(graph.factor(Bound(s.sin()), (joints, joints))),
                7 => drop(graph.factor(Sees(0.1), (constant, held, points[1]))),
                _ => drop(graph.factor(Sees(0.5), (camera, tip, points[2])).loss(Loss::Huber(0.1))),
            }
        }
        if sample % 7 == 0 {
            graph.prior(joints, &Vector::<2>::zeros(), &[0.5, f64::INFINITY]);
            graph.factor(Sees(0.6), (twice, tip, points[0]));
        }
    }
    graph.prior(base, &Pose::identity(), &[1.0; 6]);
    graph.prior(points[0], &Vector::<3>::zeros(), &[1.0; 3]);
    graph
}

struct Samples {
    graph: Graph,
    cameras: [Key<Pose>; 2],
    points: Vec<Key<Vector<3>>>,
    joints: Vec<Key<Vector<2>>>,
}

impl Samples {
    /// Every number that is estimated.
    fn values(&self) -> Vec<f64> {
        let mut values = Vec::new();
        for camera in self.cameras.map(|camera| self.graph.value(camera)) {
            values.extend(camera.rotation.iter().chain(camera.translation.iter()));
        }
        self.points.iter().for_each(|&point| values.extend(self.graph.value(point).iter()));
        self.joints.iter().for_each(|&joints| values.extend(self.graph.value(joints).iter()));
        values
    }
}

/// Free samples that look at shared cameras and points, without a derived node between chunks.
fn samples(count: usize, repeats: usize) -> Samples {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut number = move || random.random_range(-1.0..1.0);
    let mut graph = Graph::new();
    let mut pose = || Pose::new(Vector3::new(number(), number(), number()), Vector3::new(number(), number(), number()));
    let cameras = [graph.free(pose()), graph.free(pose())];
    let points: Vec<Key<Vector<3>>> = (0..4).map(|_| graph.free(pose().translation)).collect();
    for camera in cameras {
        graph.prior(camera, &Pose::identity(), &[0.7; 6]);
    }
    for &point in &points {
        graph.prior(point, &Vector::<3>::zeros(), &[0.7; 3]);
    }
    let mut all_joints = Vec::new();
    for sample in 0..count {
        let start = pose().translation;
        let joints = graph.free(Vector::<2>::new(start.x, start.y));
        let tip = graph.derive(Joint, (cameras[sample % 2], joints));
        for repeat in 0..repeats {
            graph.factor(Sees(0.1 * repeat as f64), (tip, cameras[repeat % 2], points[repeat % 4])).sigma(0.3);
        }
        graph.factor(Bound(0.3), (joints, joints));
        all_joints.push(joints);
    }
    Samples { graph, cameras, points, joints: all_joints }
}

#[test]
fn normal_equations_of_derived_nodes_agree_with_differences() {
    for seed in 0..3 {
        let agreement = check::graph(&chains(12, 18, seed)).unwrap();
        assert!(agreement.entries > 1_000, "{agreement:?}");
    }
}

#[test]
fn normal_equations_of_several_chunks_agree_with_differences() {
    let graph = samples(100, 35).graph;
    assert!(graph.factor_count() > 3_000);
    check::graph(&graph).unwrap();
    let graph = chains(90, 36, 3);
    assert!(graph.factor_count() > 3_000);
    check::graph(&graph).unwrap();
}

#[test]
fn holding_and_releasing_nodes_keeps_the_normal_equations_right() {
    let mut graph = Graph::new();
    let pose = |s: f64| Pose::new(Vector3::new(0.3 * s, -0.2, 0.1), Vector3::new(s, 0.5, 2.0));
    let (a, b) = (graph.free(pose(1.0)), graph.held(pose(-0.5)));
    let joints = graph.free(Vector::<2>::new(0.4, -0.3));
    let point = graph.free(Vector::<3>::new(0.3, 0.2, 0.9));
    let tip = graph.derive(Joint, (b, joints));
    graph.factor(Sees(0.3), (a, tip, point));
    graph.factor(Sees(0.1), (tip, b, point));
    let entries = |graph: &Graph| check::graph(graph).unwrap().entries;
    assert_eq!(entries(&graph), 11 * 12);
    graph.hold(joints);
    assert_eq!(entries(&graph), 9 * 10);
    graph.release(b);
    graph.hold(a);
    assert_eq!(entries(&graph), 9 * 10);
    graph.hold_coordinates(b, &[0, 1, 2, 3, 4, 5]);
    assert_eq!(entries(&graph), 3 * 4);
}

/// The values after one step of Levenberg-Marquardt with the given linear solver.
fn after_one_step(choose: impl FnOnce(&Workspace) -> Box<dyn LinearSolver>) -> Vec<f64> {
    let mut samples = samples(40, 12);
    let mut solver = Solver::with(&samples.graph, choose);
    let minimizer = LevenbergMarquardt { max_iterations: 1, initial_damping: 1e-2, ..LevenbergMarquardt::default() };
    let report = minimizer.minimize_with(&mut samples.graph, &mut solver, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(report.final_cost < report.initial_cost, "{report:?}");
    samples.values()
}

#[test]
fn dense_schur_and_sparse_solvers_take_the_same_step() {
    let dense = after_one_step(|workspace| Box::new(Dense::new(workspace)));
    let sparse = after_one_step(|workspace| Box::new(Sparse::new(workspace)));
    let schur = after_one_step(|workspace| Box::new(Schur::new(workspace).expect("joints can be eliminated")));
    for (i, d) in dense.iter().enumerate() {
        assert!((d - sparse[i]).abs() < 1e-10, "{i}: {d} {}", sparse[i]);
        assert!((d - schur[i]).abs() < 1e-10, "{i}: {d} {}", schur[i]);
    }
}

#[test]
fn samples_are_eliminated_where_what_they_share_has_the_same_size() {
    let mut graph = Graph::new();
    let cameras = [graph.free(Pose::identity()), graph.free(Pose::identity())];
    let points = [0.0, 1.0, 2.0].map(|x| graph.free(Vector::<3>::new(x, 1.0, 2.0)));
    for _ in 0..100 {
        let tip = graph.free(Pose::identity());
        for camera in cameras {
            for point in points {
                graph.factor(Sees(0.1), (tip, camera, point));
            }
        }
    }
    assert_eq!(Solver::new(&graph).linear_solver(), "batched Schur complement");
}

#[test]
fn the_same_bytes_come_out_on_one_thread_and_on_two() {
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut samples = samples(300, 35);
            LevenbergMarquardt::default().minimize(&mut samples.graph).unwrap();
            samples.values().iter().map(|x| x.to_bits()).collect::<Vec<u64>>()
        })
    };
    assert_eq!(run(1), run(2));
}

struct Rosenbrock;
impl Factor<2> for Rosenbrock {
    type On = (Vector<2>,);
    fn residual<T: Scalar>(&self, (x,): (Vector<2, T>,)) -> [T; 2] {
        [(x.y - x.x * x.x) * 10.0, T::one() - x.x]
    }
}

#[test]
fn many_factors_in_several_chunks_take_the_path_of_their_sum() {
    // Steps are rejected along the valley, and the system must survive that.
    let run = |copies: usize| {
        let mut graph = Graph::new();
        let x = graph.free(Vector::<2>::new(-1.2, 1.0));
        for _ in 0..copies {
            graph.factor(Rosenbrock, (x,)).sigma((copies as f64).sqrt());
        }
        let mut path = Vec::new();
        let mut solver = Solver::new(&graph);
        let report = LevenbergMarquardt::default()
            .minimize_with(&mut graph, &mut solver, &mut |iteration| {
                path.push(iteration.cost);
                ControlFlow::Continue(())
            })
            .unwrap();
        assert!(report.termination.converged() && report.termination != Termination::NoProgress, "{report:?}");
        assert!((graph.value(x) - Vector::<2>::new(1.0, 1.0)).norm() < 1e-7);
        path
    };
    let (one, many) = (run(1), run(4096));
    assert!(one.windows(2).any(|pair| pair[0] == pair[1]), "a step is rejected on the way");
    for (a, b) in one.iter().zip(&many).take_while(|(a, _)| **a > 1e-12) {
        assert!((a - b).abs() < 1e-8 * a, "{a} {b}");
    }
}
