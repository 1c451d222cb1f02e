//! A variable, a derived node and residuals of one's own, written in another crate: no macros, no Jacobians.
use handeye_solvers::{
    Covariance, Factor, Function, GaussNewton, Graph, LevenbergMarquardt, Loss, Scalar, Variable, Vector, check,
};

/// A heading in the plane as a unit complex number; a step is an angle [rad].
#[derive(Clone, Copy, Debug)]
struct Heading<T = f64> {
    cos: T,
    sin: T,
}

impl Heading {
    fn new(angle: f64) -> Self {
        Heading { cos: angle.cos(), sin: angle.sin() }
    }
}

impl Variable for Heading {
    type Over<T: Scalar> = Heading<T>;

    fn ambient(&self) -> usize {
        2
    }

    fn tangent(&self) -> usize {
        1
    }

    fn store(over: &Self, x: &mut [f64]) {
        let length = over.cos.hypot(over.sin);
        (x[0], x[1]) = (over.cos / length, over.sin / length);
    }

    fn load(x: &[f64]) -> Self {
        Heading { cos: x[0], sin: x[1] }
    }

    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Heading<T> {
        let (cos, sin) = (delta(0).cos(), delta(0).sin());
        Heading { cos: cos * x[0] - sin * x[1], sin: sin * x[0] + cos * x[1] }
    }

    fn local<T: Scalar>(x: &[f64], y: &Heading<T>, delta: &mut [T]) {
        delta[0] = (y.sin * x[0] - y.cos * x[1]).atan2(y.cos * x[0] + y.sin * x[1]);
    }
}

/// Where a robot that stands at a place sees a landmark [m], in its own frame.
struct SeenAt;
impl Function for SeenAt {
    type On = (Vector<2>, Heading, Vector<2>);
    type Output = Vector<2>;
    fn compute<T: Scalar>(&self, (at, heading, landmark): (Vector<2, T>, Heading<T>, Vector<2, T>)) -> Vector<2, T> {
        let d = landmark - at;
        Vector::<2, T>::new(heading.cos * d.x + heading.sin * d.y, heading.cos * d.y - heading.sin * d.x)
    }
}

/// A measured range and bearing.
struct RangeBearing {
    range: f64,
    bearing: f64,
}

impl Factor<2> for RangeBearing {
    type On = (Vector<2>,);
    fn residual<T: Scalar>(&self, (seen,): (Vector<2, T>,)) -> [T; 2] {
        let bearing = Heading::new(self.bearing);
        let across = seen.y * bearing.cos - seen.x * bearing.sin;
        let along = seen.x * bearing.cos + seen.y * bearing.sin;
        [seen.norm() - self.range, across.atan2(along)]
    }
}

struct Compass(f64);
impl Factor<1> for Compass {
    type On = (Heading,);
    fn residual<T: Scalar>(&self, (heading,): (Heading<T>,)) -> [T; 1] {
        let mut angle = [T::zero()];
        let Heading { cos, sin } = Heading::new(self.0);
        Heading::local(&[cos, sin], &heading, &mut angle);
        angle
    }
}

const PLACE: [f64; 2] = [1.0, -2.0];
const HEADING: f64 = 2.8;
const LANDMARKS: [[f64; 2]; 4] = [[4.0, 1.0], [-3.0, 2.0], [0.0, -6.0], [2.0, 5.0]];

/// A robot that is to be found, with one landmark mistaken for another if wanted.
fn robot(mistaken: bool) -> (Graph, handeye_solvers::Key<Vector<2>>, handeye_solvers::Key<Heading>) {
    let mut graph = Graph::new();
    let at = graph.free(Vector::<2>::zeros());
    let heading = graph.free(Heading::new(-2.9));
    graph.factor(Compass(HEADING), (heading,)).sigma(0.1);
    for (i, [x, y]) in LANDMARKS.into_iter().enumerate() {
        let landmark = graph.held(Vector::<2>::new(x, y));
        let seen = graph.derive(SeenAt, (at, heading, landmark));
        let [x, y] = if mistaken && i == 0 { [-4.0, -4.0] } else { [x, y] };
        let (dx, dy) = (x - PLACE[0], y - PLACE[1]);
        let measured = RangeBearing { range: dx.hypot(dy), bearing: dy.atan2(dx) - HEADING };
        graph.factor(measured, (seen,)).sigmas([0.05, 0.01]).loss(Loss::Cauchy(2.0));
    }
    (graph, at, heading)
}

#[test]
fn they_pass_the_checks() {
    for angle in [0.1, 2.0, -3.1] {
        check::variable(&Heading::new(angle), &Heading::new(angle + 1.2)).unwrap();
    }
    let (at, landmark) = (Vector::<2>::new(0.3, 1.0), Vector::<2>::new(-2.0, 0.5));
    check::function(&SeenAt, &(at, Heading::new(0.8), landmark)).unwrap();
    check::factor(&RangeBearing { range: 2.0, bearing: 0.4 }, &(landmark,)).unwrap();
    check::factor(&Compass(3.0), &(Heading::new(-3.1),)).unwrap();
    check::graph(&robot(true).0).unwrap();
}

#[test]
fn derivatives_outside_a_graph_are_those_of_the_formula() {
    let (x, y) = (-2.0, 0.5);
    let (residual, blocks) = RangeBearing { range: 2.0, bearing: 0.4 }.linearize(&(Vector::<2>::new(x, y),));
    let range = x.hypot(y);
    assert!((residual[0] - (range - 2.0)).abs() < 1e-14, "{residual:?}");
    let expected = [[x / range, y / range], [-y / (range * range), x / (range * range)]];
    assert_eq!((blocks.len(), blocks[0].shape()), (1, (2, 2)));
    for (row, expected) in expected.iter().enumerate() {
        for (column, expected) in expected.iter().enumerate() {
            assert!((blocks[0][(row, column)] - expected).abs() < 1e-14, "{}", blocks[0]);
        }
    }
}

#[test]
fn the_robot_is_found_across_the_cut_at_half_a_turn() {
    let (mut graph, at, heading) = robot(false);
    LevenbergMarquardt::default().minimize(&mut graph).unwrap();
    let found = graph.value(heading);
    assert!((graph.value(at) - Vector::<2>::from(PLACE)).norm() < 1e-8);
    assert!((found.cos - HEADING.cos()).abs() < 1e-8 && (found.sin - HEADING.sin()).abs() < 1e-8);
    // Held, the compass and the landmarks change nothing.
    graph.hold(heading);
    GaussNewton::default().minimize(&mut graph).unwrap();
    assert!((graph.value(at) - Vector::<2>::from(PLACE)).norm() < 1e-8);
}

#[test]
fn a_mistaken_landmark_does_not_spoil_it() {
    let (mut graph, at, _) = robot(true);
    LevenbergMarquardt::default().minimize(&mut graph).unwrap();
    let deviation = Covariance::new(&graph).unwrap().of(at)[(0, 0)].sqrt();
    assert!((graph.value(at) - Vector::<2>::from(PLACE)).norm() < 3.0 * deviation, "{}", graph.value(at));
}
