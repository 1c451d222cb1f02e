//! Covariances against closed forms, against each other and against the scatter of estimates.
use handeye_solvers::linear::{Dense, LinearSolver, Schur, Sparse};
use handeye_solvers::nalgebra::{DMatrix, Vector3};
use handeye_solvers::{
    Covariance, Error, Factor, Function, Graph, Key, LevenbergMarquardt, Pose, Scalar, Solver, Vector, Workspace,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// x₀ - m₀.
struct Offset;
impl Factor<1> for Offset {
    type On = (Vector<2>, Vector<3>);
    fn residual<T: Scalar>(&self, (x, m): (Vector<2, T>, Vector<3, T>)) -> [T; 1] {
        [x.x - m.x]
    }
}

struct Sum;
impl Function for Sum {
    type On = (Vector<2>, Vector<3>);
    type Output = Vector<1>;
    fn compute<T: Scalar>(&self, (x, m): (Vector<2, T>, Vector<3, T>)) -> Vector<1, T> {
        Vector::<1, T>::new(x.x * 2.0 + m.x)
    }
}

/// `count` readings x_k of one number m, with var x_k = p before, var m = q before and var (x_k - m) = r.
fn readings(count: usize) -> (Graph, Key<Vector<3>>, Vec<Key<Vector<2>>>) {
    let mut graph = Graph::new();
    let m = graph.free(Vector::<3>::zeros());
    graph.prior(m, &Vector::<3>::zeros(), &[Q.sqrt(), 1.0, 1.0]);
    graph.hold_coordinates(m, &[2]);
    let readings = (0..count)
        .map(|_| {
            let x = graph.free(Vector::<2>::zeros());
            graph.prior(x, &Vector::<2>::zeros(), &[P.sqrt(), 1.0]);
            graph.factor(Offset, (x, m)).sigma(R.sqrt());
            x
        })
        .collect();
    (graph, m, readings)
}

const P: f64 = 0.7;
const Q: f64 = 1.3;
const R: f64 = 0.2;

#[test]
fn twenty_thousand_readings_have_the_covariance_of_the_closed_form() {
    let count = 20_000;
    let (mut graph, m, readings) = readings(count);
    let sum = graph.derive(Sum, (readings[7], m));
    let mut covariance = Covariance::new(&graph).unwrap();
    let of_m = 1.0 / (1.0 / Q + count as f64 / (P + R));
    let alone = 1.0 / (1.0 / P + 1.0 / R);
    let follows = alone / R;
    let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    let found = covariance.of(m);
    near(found[(0, 0)], of_m);
    near(found[(1, 1)], 1.0);
    assert_eq!(found.row(2).abs().max(), 0.0, "what is held is certain");
    for &x in readings.iter().step_by(997) {
        near(covariance.of(x)[(0, 0)], alone + follows * follows * of_m);
        near(covariance.between(x, m)[(0, 0)], follows * of_m);
    }
    near(covariance.between(readings[3], readings[19_999])[(0, 0)], follows * follows * of_m);
    // 2 x + m, derived: 4 var x + 4 cov(x, m) + var m.
    let var_x = alone + follows * follows * of_m;
    near(covariance.of(sum)[(0, 0)], 4.0 * var_x + 4.0 * follows * of_m + of_m);
    assert_eq!(covariance.into_solver().linear_solver(), "batched Schur complement");
}

#[test]
fn parts_of_a_covariance_by_what_causes_them_add_up_and_are_those_of_the_closed_form() {
    let mut graph = Graph::new();
    let m = graph.free(Vector::<3>::zeros());
    let of_m = graph.prior(m, &Vector::<3>::zeros(), &[Q.sqrt(), 1.0, 1.0]);
    let (mut before, mut readings, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..300 {
        let x = graph.free(Vector::<2>::zeros());
        before.push(graph.prior(x, &Vector::<2>::zeros(), &[P.sqrt(), 1.0]));
        readings.push(graph.factor(Offset, (x, m)).sigma(R.sqrt()).key);
        nodes.push(x);
    }
    let sum = graph.derive(Sum, (nodes[7], m));
    let groups = [vec![of_m], before, readings, Vec::new()];
    let mut covariance = Covariance::new(&graph).unwrap();
    let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    // Each of n readings of variance s = P + R errs by what was assumed of x and by itself.
    let (s, n) = (P + R, 300.0);
    let var_m = 1.0 / (1.0 / Q + n / s);
    let parts = covariance.due_to(m, &groups);
    for (part, expected) in
        parts.iter().zip([var_m.powi(2) / Q, n * (var_m / s).powi(2) * P, n * (var_m / s).powi(2) * R])
    {
        near(part[(0, 0)], expected);
    }
    assert_eq!(parts[3].abs().max(), 0.0);
    let whole = covariance.of(sum);
    let parts = covariance.due_to(sum, &groups);
    near(parts.iter().map(|part| part[(0, 0)]).sum(), whole[(0, 0)]);
    assert_eq!(covariance.into_solver().linear_solver(), "batched Schur complement");
}

#[test]
fn all_linear_solvers_give_the_same_blocks() {
    type Choice = fn(&Workspace) -> Box<dyn LinearSolver>;
    let choices: [Choice; 3] = [
        |workspace| Box::new(Dense::new(workspace)),
        |workspace| Box::new(Sparse::new(workspace)),
        |workspace| Box::new(Schur::new(workspace).expect("readings can be eliminated")),
    ];
    let blocks = choices.map(|choose| {
        let (graph, m, readings) = readings(20);
        let mut covariance = Covariance::with(&graph, Solver::with(&graph, choose)).unwrap();
        let mut all = vec![covariance.of(m)];
        for &x in &readings {
            all.push(covariance.of(x));
            all.push(covariance.between(m, x));
            all.push(covariance.between(readings[4], x));
        }
        all
    });
    for (a, (b, c)) in blocks[0].iter().zip(blocks[1].iter().zip(&blocks[2])) {
        assert!((a - b).amax() < 1e-12 && (a - c).amax() < 1e-12, "{a} {b} {c}");
    }
}

#[test]
fn an_open_direction_has_no_covariance() {
    let mut graph = Graph::new();
    let (m, x) = (graph.free(Vector::<3>::zeros()), graph.free(Vector::<2>::zeros()));
    graph.factor(Offset, (x, m));
    let is_singular = |graph: &Graph| Covariance::new(graph).err() == Some(Error::Singular);
    assert!(is_singular(&graph));
    // Every coordinate has information of its own now, but x₀ and m₀ can still move together.
    graph.prior(x, &Vector::<2>::zeros(), &[f64::INFINITY, 1.0]);
    graph.prior(m, &Vector::<3>::zeros(), &[f64::INFINITY, 1.0, 1.0]);
    assert!(is_singular(&graph));
    graph.prior(x, &Vector::<2>::zeros(), &[100.0, f64::INFINITY]);
    let variance = Covariance::new(&graph).unwrap().of(m)[(0, 0)];
    assert!((variance - 10_001.0).abs() < 1e-3, "{variance}");
    // Nothing at all is said about this one.
    graph.free(Vector::<1>::zeros());
    assert!(is_singular(&graph));
}

/// A point seen by a camera at a pose that is looked for.
struct Pixel([f64; 3], [f64; 2]);
impl Factor<2> for Pixel {
    type On = (Pose,);
    fn residual<T: Scalar>(&self, (world_from_camera,): (Pose<T>,)) -> [T; 2] {
        let p = world_from_camera.inverse_transform(&Vector3::from(self.0).map(T::from));
        [p.x / p.z * 500.0 - self.1[0], p.y / p.z * 500.0 - self.1[1]]
    }
}

#[test]
fn estimates_scatter_as_their_covariance_says() {
    // d Σ⁻¹ d of a pose is χ² with 6 degrees of freedom, so its mean over 300 seeds is 6 ± 3 √(12 / 300).
    let truth = Pose::new(Vector3::new(0.2, -0.3, 0.1), Vector3::new(0.1, 0.2, -3.0));
    let seeds = 300;
    let mut total = 0.0;
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut graph = Graph::new();
        let pose = graph.free(truth);
        for i in 0..12 {
            let i = f64::from(i);
            let point = [i.sin(), (2.3 * i).cos(), 0.6 * (1.7 * i).sin()];
            let [x, y] = Pixel(point, [0.0; 2]).residual((truth,));
            let mut noise = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>() * 0.5;
            graph.factor(Pixel(point, [x + noise(), y + noise()]), (pose,)).sigma(0.5);
        }
        LevenbergMarquardt::default().minimize(&mut graph).unwrap();
        let found = graph.value(pose);
        let mut step = [0.0; 6];
        step[..3].copy_from_slice(
            handeye_solvers::manifold::so3::log(&(truth.rotation * found.rotation.transpose())).as_slice(),
        );
        step[3..].copy_from_slice((truth.translation - found.translation).as_slice());
        let step = DMatrix::from_column_slice(6, 1, &step);
        let covariance = Covariance::new(&graph).unwrap().of(pose);
        total += step.dot(&covariance.cholesky().unwrap().solve(&step));
    }
    let mean = total / seeds as f64;
    assert!((mean - 6.0).abs() < 3.0 * (12.0 / seeds as f64).sqrt(), "{mean}");
}
