//! Directions that nothing, or only a prior, determines, in problems whose freedoms are known.
use handeye_solvers::nalgebra::{DMatrix, DVector};
use handeye_solvers::{Factor, Graph, Key, Scalar, Solver, Vector, WeakDirection, Weakness};

/// A pose (x, y, heading) in the plane sees a landmark: where it is in its own frame, or the bearing to it alone.
struct Sees;
impl Factor<2> for Sees {
    type On = (Vector<3>, Vector<2>);
    fn residual<T: Scalar>(&self, (pose, landmark): (Vector<3, T>, Vector<2, T>)) -> [T; 2] {
        let (dx, dy) = (landmark.x - pose.x, landmark.y - pose.y);
        let (sin, cos) = (pose.z.sin(), pose.z.cos());
        [dx * cos + dy * sin, dy * cos - dx * sin]
    }
}

struct Bearing;
impl Factor<1> for Bearing {
    type On = (Vector<3>, Vector<2>);
    fn residual<T: Scalar>(&self, (pose, landmark): (Vector<3, T>, Vector<2, T>)) -> [T; 1] {
        [(landmark.y - pose.y).atan2(landmark.x - pose.x) - pose.z]
    }
}

struct World {
    graph: Graph,
    poses: Vec<Key<Vector<3>>>,
    landmarks: Vec<Key<Vector<2>>>,
}

fn world(bearings_alone: bool) -> World {
    let mut graph = Graph::new();
    let at = |i: usize, s: f64| (s * (2.1 * i as f64).sin(), s * (1.3 * i as f64 + 0.5).cos());
    let landmarks: Vec<_> = (0..6).map(|i| at(i, 3.0)).map(|(x, y)| graph.free(Vector::<2>::new(x, y))).collect();
    let poses: Vec<_> =
        (0..12).map(|i| at(i + 9, 1.0)).map(|(x, y)| graph.free(Vector::<3>::new(x, y, x * y))).collect();
    for &pose in &poses {
        for &landmark in &landmarks {
            if bearings_alone {
                graph.factor(Bearing, (pose, landmark)).sigma(1e-3);
            } else {
                graph.factor(Sees, (pose, landmark)).sigma(1e-3);
            }
        }
    }
    World { graph, poses, landmarks }
}

impl World {
    fn find(&self, nuisance: Option<&[usize]>) -> Vec<WeakDirection> {
        WeakDirection::find(&self.graph, &mut Solver::new(&self.graph), nuisance).unwrap()
    }

    fn kinds(&self) -> (usize, usize) {
        let found = self.find(None);
        let open = found.iter().filter(|direction| direction.kind == Weakness::Open).count();
        (open, found.len() - open)
    }

    /// Shifts, turn and growth of the landmarks.
    fn gauge(&self) -> DMatrix<f64> {
        DMatrix::from_fn(2 * self.landmarks.len(), 4, |row, freedom| {
            let p = self.graph.value(self.landmarks[row / 2]);
            let (own, other) = if row % 2 == 0 { (p.x, -p.y) } else { (p.y, p.x) };
            match freedom {
                0 => f64::from(row % 2 == 0),
                1 => f64::from(row % 2 == 1),
                2 => other,
                _ => own,
            }
        })
    }
}

#[test]
fn the_frame_is_open_and_with_bearings_alone_so_is_the_scale() {
    assert_eq!(world(false).kinds(), (3, 0));
    assert_eq!(world(true).kinds(), (4, 0));
}

#[test]
fn open_directions_move_the_landmarks_as_the_gauge_does() {
    let world = world(true);
    let first = world.landmarks[0].index();
    let poses: Vec<usize> = world.poses.iter().map(|pose| pose.index()).collect();
    for found in [world.find(None), world.find(Some(&poses)), world.find(Some(&[]))] {
        assert_eq!(found.len(), 4);
        for direction in found {
            assert_eq!((direction.kind, direction.components[0].weight), (Weakness::Open, 1.0));
            let mut moved = DVector::zeros(12);
            for component in direction.components.iter().filter(|component| component.node < first + 6) {
                moved[2 * (component.node - first) + component.coordinate] = component.weight;
            }
            let gauge = world.gauge();
            let fit = &gauge * gauge.clone().svd(true, true).solve(&moved, 1e-12).unwrap();
            assert!((&fit - &moved).norm() < 1e-5 * moved.norm(), "{fit} {moved}");
        }
    }
}

#[test]
fn what_priors_alone_determine_is_told_from_what_is_open() {
    for sigma in [1.0, 1e4] {
        // One landmark ties the shifts; the turn and the scale stay open. A second one's distance ties the scale and the turn.
        let mut world = world(true);
        let origin = world.graph.value(world.landmarks[0]);
        world.graph.prior(world.landmarks[0], &origin, &[sigma; 2]);
        assert_eq!(world.kinds(), (2, 2), "sigma {sigma}");
        let other = world.graph.value(world.landmarks[1]);
        world.graph.prior(world.landmarks[1], &other, &[sigma; 2]);
        assert_eq!(world.kinds(), (0, 4), "sigma {sigma}");
        // The same from a nuisance node's prior.
        world.graph.hold(world.landmarks[0]);
        world.graph.hold(world.landmarks[1]);
        assert_eq!(world.kinds(), (0, 0), "sigma {sigma}");
    }
    let mut world = world(false);
    let pose = world.graph.value(world.poses[3]);
    world.graph.prior(world.poses[3], &pose, &[0.1, 0.1, 0.01]);
    assert_eq!(world.kinds(), (0, 3));
}

struct Reads(f64);
impl Factor<1> for Reads {
    type On = (Vector<2>,);
    fn residual<T: Scalar>(&self, (x,): (Vector<2, T>,)) -> [T; 1] {
        [x.y - self.0]
    }
}

#[test]
fn a_prior_outweighs_the_data_where_it_is_narrower() {
    let kinds = |data: f64, prior: f64| {
        let mut graph = Graph::new();
        let x = graph.free(Vector::<2>::zeros());
        graph.prior(x, &Vector::<2>::zeros(), &[prior, prior]);
        graph.factor(Reads(0.0), (x,)).sigma(data);
        let found = WeakDirection::find(&graph, &mut Solver::new(&graph), None).unwrap();
        found.iter().map(|d| (d.kind, d.components[0].coordinate, d.sd_ratio)).collect::<Vec<_>>()
    };
    // Nothing but the prior is known of x₀.
    assert_eq!(kinds(0.5, 1.0).len(), 1);
    let [(Weakness::Prior, 0, first), (Weakness::Prior, 1, second)] = kinds(2.0, 1.0)[..] else { panic!("two priors") };
    assert!(first > 1e3 && (second - 2.0).abs() < 1e-6, "{first} {second}");
}

#[test]
fn a_node_without_factors_is_open_in_every_free_coordinate() {
    let mut world = world(false);
    let alone = world.graph.free(Vector::<3>::zeros());
    world.graph.hold_coordinates(alone, &[1]);
    assert_eq!(world.kinds(), (5, 0));
}
