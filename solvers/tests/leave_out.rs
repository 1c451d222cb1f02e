//! Leaving factors out against solving the graph without them.
use handeye_solvers::{
    Error, Factor, FactorKey, Function, GaussNewton, Graph, Key, LeaveOut, LevenbergMarquardt, Loss, Scalar, Solver,
    Vector,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Where a turned and moved frame m carries a point x.
struct Carried;
impl Function for Carried {
    type On = (Vector<2>, Vector<4>);
    type Output = Vector<2>;
    fn compute<T: Scalar>(&self, (x, m): (Vector<2, T>, Vector<4, T>)) -> Vector<2, T> {
        let (sin, cos) = (m[2].sin(), m[2].cos());
        Vector::<2, T>::new(cos * x.x - sin * x.y + m[0], sin * x.x + cos * x.y + m[1] + m[3] * x.x)
    }
}

/// A landmark as it is seen from a place.
struct Seen([f64; 2]);
impl Factor<2> for Seen {
    type On = (Vector<2>, Vector<2>);
    fn residual<T: Scalar>(&self, (from, landmark): (Vector<2, T>, Vector<2, T>)) -> [T; 2] {
        let d = landmark - from;
        [d.x + d.x * d.y * 0.1 - self.0[0], d.y + d.x * d.x * 0.1 - self.0[1]]
    }
}

/// How far one place is from the next.
struct Moved([f64; 2]);
impl Factor<2> for Moved {
    type On = (Vector<2>, Vector<2>);
    fn residual<T: Scalar>(&self, (a, b): (Vector<2, T>, Vector<2, T>)) -> [T; 2] {
        [b.x - a.x - self.0[0], b.y - a.y - self.0[1]]
    }
}

/// What is known of the places where landmarks are seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Places {
    Exact,
    /// As good as the landmarks' own positions.
    Read,
    /// Every other one, and the rest from the landmarks alone.
    HalfRead,
    /// The first two, and from each to the next.
    Linked,
}

struct Problem {
    graph: Graph,
    /// What is the same for all groups: a frame and landmarks.
    frame: Key<Vector<4>>,
    landmarks: Vec<Key<Vector<2>>>,
    groups: Vec<Vec<FactorKey>>,
}

impl Problem {
    fn wanted(&self) -> Vec<usize> {
        std::iter::once(self.frame.index()).chain(self.landmarks.iter().map(|key| key.index())).collect()
    }

    fn values(&self) -> Vec<f64> {
        let landmarks = self.landmarks.iter().flat_map(|&key| self.graph.value(key).as_slice().to_vec());
        self.graph.value(self.frame).iter().copied().chain(landmarks).collect()
    }
}

/// `count` places from which landmarks are seen with noise, all but one group of factors; the last landmark is seen from place 5 alone.
fn problem(count: usize, places: Places, without: Option<usize>, at: Option<&Graph>) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut noise = |size: f64| random.random_range(-size..size);
    let mut graph = Graph::new();
    let frame = graph.free(Vector::<4>::new(0.3, -0.2, 0.4, 0.0));
    graph.hold_coordinates(frame, &[3]);
    let positions = [[2.0, 1.0], [-1.0, 2.0], [0.5, -2.0], [-2.0, -0.5]].map(Vector::<2>::from);
    let landmarks: Vec<_> = positions.iter().map(|&position| graph.free(position)).collect();
    for (&landmark, position) in landmarks.iter().zip(&positions).take(2) {
        graph.prior(landmark, position, &[0.3, 0.3]);
    }
    // Seen by nobody.
    graph.free(Vector::<2>::zeros());
    let nodes: Vec<(Vector<2>, Key<Vector<2>>)> = (0..count)
        .map(|k| {
            let x = Vector::<2>::new((2.1 * k as f64).sin(), (1.3 * k as f64).cos());
            let node = graph.free(x);
            if places == Places::Exact {
                graph.hold(node);
            }
            let is_read = match places {
                Places::Exact => false,
                Places::Read => true,
                Places::HalfRead => k % 2 == 0,
                Places::Linked => k < 2,
            };
            if is_read {
                graph.prior(node, &(x + Vector::<2>::new(noise(0.05), noise(0.05))), &[0.05, 0.08]);
            }
            (x, node)
        })
        .collect();
    let mut groups = vec![Vec::new(); count];
    for (k, &(x, node)) in nodes.iter().enumerate() {
        let from = graph.derive(Carried, (node, frame));
        let truth = Carried.compute((x, Vector::<4>::new(0.3, -0.2, 0.4, 0.0)));
        for (l, (&landmark, position)) in landmarks.iter().zip(&positions).enumerate() {
            let [u, v] = Seen([0.0; 2]).residual((truth, *position));
            let seen = Seen([u + noise(0.1), v + noise(0.1)]);
            if without != Some(k) && (l != 3 || k == 5) {
                groups[k].push(graph.factor(seen, (from, landmark)).sigma(0.05).loss(Loss::Cauchy(2.0)).key);
            }
        }
    }
    for pair in nodes.windows(2).filter(|_| places == Places::Linked) {
        let moved = pair[1].0 - pair[0].0;
        graph.factor(Moved([moved.x + noise(0.03), moved.y]), (pair[0].1, pair[1].1)).sigma(0.03);
    }
    if let Some(at) = at {
        // The same nodes were added in the same order.
        graph.set(frame, &at.value(frame));
        landmarks.iter().for_each(|&key| graph.set(key, &at.value(key)));
        nodes.iter().for_each(|&(_, key)| graph.set(key, &at.value(key)));
    }
    Problem { graph, frame, landmarks, groups }
}

fn one_step(graph: &mut Graph) -> Result<(), Error> {
    let once = GaussNewton { max_iterations: 1, halvings: 0, ..GaussNewton::default() };
    once.minimize(graph).map(|_| ())
}

#[test]
fn the_step_without_a_group_is_that_of_the_graph_without_it() {
    for (places, count) in [
        (Places::Exact, 12),
        (Places::Read, 4),
        (Places::Read, 12),
        (Places::HalfRead, 12),
        (Places::Linked, 12),
        (Places::Linked, 400),
    ] {
        // Both at a minimum and beside it.
        for iterations in [0, 50] {
            let mut whole = problem(count, places, None, None);
            LevenbergMarquardt { max_iterations: iterations, ..Default::default() }.minimize(&mut whole.graph).unwrap();
            let wanted = whole.wanted();
            let leave_out = LeaveOut::new(&whole.graph, &whole.groups, &wanted).unwrap();
            let before = whole.values();
            for k in (0..count.min(12)).chain([count - 1]) {
                let found: Vec<f64> =
                    leave_out.step(k).unwrap().iter().flat_map(|step| step.as_slice().to_vec()).collect();
                let mut without = problem(count, places, Some(k), Some(&whole.graph));
                one_step(&mut without.graph).unwrap();
                let after = without.values();
                let expected: Vec<f64> = after.iter().zip(&before).map(|(after, before)| after - before).collect();
                let size = expected.iter().fold(0.0, |most: f64, step| most.max(step.abs()));
                assert!(size > 1e-6, "{places:?}: leaving out {k} changes something");
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((found - expected).abs() < 1e-9 * size, "{places:?} {count} {k}: {found} {expected}");
                }
            }
        }
    }
}

#[test]
fn every_linear_solver_is_put_to_use() {
    let name = |count, places| Solver::new(&problem(count, places, None, None).graph).linear_solver();
    let names = [name(4, Places::Read), name(12, Places::Read), name(400, Places::Linked)];
    assert_eq!(names, ["dense Cholesky", "batched Schur complement", "sparse Cholesky"]);
}

#[test]
fn what_only_a_group_determines_is_open_without_it() {
    let mut graph = Graph::new();
    let x = graph.free(Vector::<2>::new(1.0, 2.0));
    let y = graph.free(Vector::<2>::zeros());
    let prior = |graph: &mut Graph, sigmas: [f64; 2]| vec![graph.prior(x, &Vector::<2>::zeros(), &sigmas)];
    let groups = [
        prior(&mut graph, [0.1, f64::INFINITY]),
        prior(&mut graph, [0.2, 0.3]),
        prior(&mut graph, [0.3, f64::INFINITY]),
        vec![graph.prior(y, &Vector::<2>::repeat(3.0), &[1.0, 1.0])],
        Vec::new(),
    ];
    let leave_out = LeaveOut::new(&graph, &groups, &[x.index(), y.index()]).unwrap();
    let steps: Vec<_> = (0..5).map(|group| leave_out.step(group)).collect();
    assert!(steps[1].is_none(), "nothing else is said of the second coordinate");
    for group in [0, 2, 4] {
        let step = steps[group].as_ref().unwrap();
        let expected = [-1.0, -2.0, 3.0, 3.0];
        assert!(step[0].iter().chain(&step[1]).zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{step:?}");
    }
    let step = steps[3].as_ref().unwrap();
    assert_eq!(step[1].amax(), 0.0, "what no factor is left on stays where it is");
    assert!((step[0][0] + 1.0).abs() < 1e-12);
    assert_eq!(leave_out.step(2), steps[2]);
}

#[test]
fn what_all_factors_leave_open_is_an_error() {
    let mut graph = Graph::new();
    let x = graph.free(Vector::<2>::zeros());
    let groups = [vec![graph.prior(x, &Vector::<2>::zeros(), &[1.0, f64::INFINITY])]];
    assert_eq!(LeaveOut::new(&graph, &groups, &[x.index()]).err(), Some(Error::Singular));
    graph.hold(x);
    assert_eq!(LeaveOut::new(&graph, &groups, &[x.index()]).err(), Some(Error::NothingFree));
}
