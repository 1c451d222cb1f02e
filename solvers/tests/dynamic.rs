//! Residuals of a size known at run time do what those known at compile time do.
use handeye_solvers::{
    AnyKey, Covariance, DynamicFactor, DynamicVector, Error, Factor, Graph, Jacobian, LevenbergMarquardt, Loss, Pose,
    Scalar, Vector, Workspace, check,
};
use nalgebra::Vector3;

/// A point on a body, seen in space: R p + t - seen.
struct Seen {
    on_body: Vector3<f64>,
    seen: Vector3<f64>,
}

impl Factor<3> for Seen {
    type On = (Pose,);
    fn residual<T: Scalar>(&self, (pose,): (Pose<T>,)) -> [T; 3] {
        let point = pose.transform(&self.on_body.map(T::from));
        std::array::from_fn(|i| point[i] - self.seen[i])
    }
}

impl DynamicFactor for Seen {
    fn residual(&self, x: &[&[f64]], r: &mut [f64]) {
        r.copy_from_slice(&Factor::residual::<f64>(self, (Pose::from_stored(x[0]),)));
    }
}

/// x_i y - target, of any length, with or without derivatives.
struct Scaled {
    target: Vec<f64>,
    knows_slopes: bool,
}

impl DynamicFactor for Scaled {
    fn residual(&self, x: &[&[f64]], r: &mut [f64]) {
        for (i, r) in r.iter_mut().enumerate() {
            *r = x[0][i] * x[1][0] - self.target[i];
        }
    }

    fn linearize(&self, x: &[&[f64]], r: &mut [f64], jacobian: &mut Jacobian<'_>) -> bool {
        if !self.knows_slopes {
            return false;
        }
        DynamicFactor::residual(self, x, r);
        for i in 0..r.len() {
            if jacobian.wanted(0) {
                let row = jacobian.row(i, 0);
                row.fill(0.0);
                row[i] = x[1][0];
            }
            if jacobian.wanted(1) {
                jacobian.row(i, 1)[0] = x[0][i];
            }
        }
        true
    }
}

const BODY: [[f64; 3]; 4] = [[0.0, 0.1, 0.2], [1.0, 0.0, -0.3], [-0.4, 0.8, 0.0], [0.5, 0.5, 0.9]];

/// The same body seen through static or dynamic factors, one of them with a robust loss.
fn body(is_dynamic: bool) -> (Graph, handeye_solvers::Key<Pose>) {
    let truth = Pose::new(Vector3::new(0.4, -1.1, 0.7), Vector3::new(2.0, 0.3, -1.0));
    let mut graph = Graph::new();
    let pose = graph.free(Pose::new(Vector3::new(0.3, -0.9, 0.9), Vector3::new(1.8, 0.1, -0.7)));
    for (i, point) in BODY.into_iter().enumerate() {
        let on_body = Vector3::from(point);
        let seen = truth.transform(&on_body) + Vector3::new(0.01, -0.02, 0.015) * (i as f64 - 1.0);
        let (sigmas, loss) = ([0.1, 0.2, 0.3], if i == 2 { Loss::Cauchy(0.5) } else { Loss::Squared });
        let factor = Seen { on_body, seen };
        if is_dynamic {
            graph.dynamic_factor(factor, 3, &[pose.into()]).unwrap().sigmas(&sigmas).loss(loss);
        } else {
            graph.factor(factor, (pose,)).sigmas(sigmas).loss(loss);
        }
    }
    (graph, pose)
}

#[test]
fn the_normal_equations_of_a_pose_are_those_of_the_same_factors_written_for_it() {
    let [(one, _), (other, _)] = [true, false].map(body);
    let [(h_one, b_one), (h, b)] = [one, other].map(|graph| {
        let mut workspace = Workspace::new(&graph);
        workspace.linearize_at(&graph);
        workspace.normal_equations()
    });
    let relative = |difference: f64, size: f64| difference / size;
    assert!(
        relative((h_one - &h).amax(), h.amax()) < 1e-8,
        "differences are good to the root of the rounding, squared"
    );
    assert!(relative((b_one - &b).amax(), b.amax()) < 1e-8);
}

#[test]
fn both_find_the_same_minimum_and_covariance() {
    let found = [true, false].map(|is_dynamic| {
        let (mut graph, pose) = body(is_dynamic);
        let report = LevenbergMarquardt::default().minimize(&mut graph).unwrap();
        assert!(report.termination.converged());
        let covariance = Covariance::new(&graph).unwrap().of(pose);
        (graph.value(pose), covariance)
    });
    let [(one, of_one), (other, of_other)] = &found;
    assert!((one.translation - other.translation).norm() < 1e-7 && one.angle_to(other) < 1e-7);
    assert!((of_one - of_other).amax() < 1e-6 * of_other.amax());
}

#[test]
fn derivatives_that_are_given_are_those_of_differences_and_sizes_may_differ() {
    let solve = |knows_slopes: bool| {
        let mut graph = Graph::new();
        let long = graph.free(DynamicVector::from_vec(vec![1.0, -2.0, 3.0, 0.5]));
        let short = graph.free(DynamicVector::from_vec(vec![1.0]));
        let factor = |target: Vec<f64>| Scaled { target, knows_slopes };
        graph.dynamic_factor(factor(vec![2.0, 4.0, 6.0, 8.0]), 4, &[long.into(), short.into()]).unwrap().sigma(0.1);
        graph.dynamic_factor(factor(vec![2.0, 4.0]), 2, &[long.into(), short.into()]).unwrap().sigma(0.2);
        graph.prior(short, &DynamicVector::from_vec(vec![2.0]), &[0.1]);
        // The last number stays, so that no scale makes up for it.
        graph.hold_coordinates(long, &[3]);
        check::graph(&graph).unwrap();
        let to_the_end = LevenbergMarquardt { cost_tolerance: 0.0, ..LevenbergMarquardt::default() };
        to_the_end.minimize(&mut graph).unwrap();
        (graph.value(long), graph.value(short))
    };
    let [(one, scale), (other, _)] = [true, false].map(solve);
    assert!((&one - other).amax() < 1e-7);
    // The first three reach their targets whatever the scale is: it alone answers to its prior and to the last number, held at 0.5.
    let expected = (8.0 * 0.5 / 0.01 + 2.0 / 0.01) / (0.5 * 0.5 / 0.01 + 1.0 / 0.01);
    assert!((scale[0] - expected).abs() < 1e-8, "{scale}");
    for (i, target) in [2.0, 4.0, 6.0].into_iter().enumerate() {
        assert!((one[i] - target / expected).abs() < 1e-8);
    }
    assert_eq!(one[3], 0.5);
}

#[test]
fn a_factor_on_no_node_or_on_nine_is_refused() {
    let mut graph = Graph::new();
    let node: AnyKey = graph.free(Vector::<1>::zeros()).into();
    for on in [vec![], vec![node; 9]] {
        let factor = Scaled { target: Vec::new(), knows_slopes: false };
        let refused = graph.dynamic_factor(factor, 0, &on).err();
        assert_eq!(refused, Some(Error::Arguments { found: on.len(), most: 8 }));
    }
    assert_eq!(graph.factor_count(), 0);
}
