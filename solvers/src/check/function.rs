//! Jacobians of factors and functions against differences.
use super::differences::derivative;
use super::{Agreement, Comparison, Mismatch};
use crate::jacobian::{Columns, Coordinates, Jacobian};
use crate::{Factor, Function, Variable, Variables};

/// Compares what a factor's `evaluate` writes with its `residual` and with differences of it, at the given variables.
///
/// Once with everything free, and once for every coordinate with everything else held, which an `evaluate` of your own
/// must cope with too.
///
/// ```
/// # use handeye_solvers::{Factor, Scalar, Vector, check};
/// # struct Distance(f64);
/// # impl Factor<1> for Distance {
/// #     type On = (Vector<2>, Vector<2>);
/// #     fn residual<T: Scalar>(&self, (a, b): (Vector<2, T>, Vector<2, T>)) -> [T; 1] {
/// #         [(a - b).norm() - self.0]
/// #     }
/// # }
/// check::factor(&Distance(5.0), &(Vector::<2>::new(1.0, 2.0), Vector::<2>::new(-1.0, 0.5)))?;
/// # Ok::<(), check::Mismatch>(())
/// ```
pub fn factor<F: Factor<M>, const M: usize>(factor: &F, at: &F::On) -> Result<Agreement, Mismatch> {
    let residual = |x: &[&[f64]]| factor.residual::<f64>(F::On::seed(x, |_, _| 0.0)).to_vec();
    let evaluate = |x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>| factor.evaluate(x, jacobian).to_vec();
    compare::<F::On>(at, M, residual, evaluate)
}

/// Compares what a function's `evaluate` writes with its `compute` and with differences of it, as
/// [`factor`](super::factor) does.
pub fn function<F: Function>(function: &F, at: &F::On) -> Result<Agreement, Mismatch> {
    let value = |x: &[&[f64]]| function.compute::<f64>(F::On::seed(x, |_, _| 0.0));
    let stored = at.stored();
    let y0 = value(&slices(&stored));
    let mut base = vec![0.0; y0.ambient()];
    F::Output::store(&y0, &mut base);
    let step = |y: &F::Output| {
        let mut step = vec![0.0; y0.tangent()];
        F::Output::local(&base, y, &mut step);
        step
    };
    let evaluate = |x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>| {
        let mut y = vec![0.0; base.len()];
        function.evaluate(x, &mut y, jacobian);
        step(&F::Output::load(&y))
    };
    compare::<F::On>(at, y0.tangent(), |x| step(&value(x)), evaluate)
}

fn slices(stored: &[(Vec<f64>, usize)]) -> Vec<&[f64]> {
    stored.iter().map(|(x, _)| x.as_slice()).collect()
}

fn compare<V: Variables>(
    at: &V,
    rows: usize,
    value: impl Fn(&[&[f64]]) -> Vec<f64>,
    evaluate: impl Fn(&[&[f64]], Option<&mut Jacobian<'_>>) -> Vec<f64>,
) -> Result<Agreement, Mismatch> {
    let stored = at.stored();
    let x = slices(&stored);
    let mut comparison = Comparison::default();
    let expected_value = value(&x);
    for (row, (expected, found)) in expected_value.iter().zip(evaluate(&x, None)).enumerate() {
        comparison.entry("value", (row, 0), *expected, found, expected.abs().max(1e-6), 0.0);
    }
    let coordinates: Vec<(usize, usize)> =
        stored.iter().enumerate().flat_map(|(k, (_, tangent))| (0..*tangent).map(move |i| (k, i))).collect();
    let expected: Vec<Vec<(f64, f64)>> = coordinates
        .iter()
        .map(|&(k, i)| {
            derivative(|h| {
                let mut delta = vec![0.0; stored[k].1];
                delta[i] = h;
                let mut moved = stored[k].0.clone();
                V::retract(k, &stored[k].0, &delta, &mut moved);
                let mut x = x.clone();
                x[k] = &moved;
                value(&x)
            })
        })
        .collect();
    // Entries much smaller than the largest of their row are judged by a thousandth of that.
    let largest: Vec<f64> =
        (0..rows).map(|row| expected.iter().map(|column| column[row].0.abs()).fold(1e-9, f64::max)).collect();
    let mut judge = |what: &str, free: &[Coordinates<'_>]| {
        let (columns, width) = layout(&stored, free);
        let mut data = vec![f64::NAN; rows * width];
        let found_value = evaluate(&x, Some(&mut Jacobian { data: &mut data, columns: &columns, width }));
        for (row, (expected, found)) in expected_value.iter().zip(found_value).enumerate() {
            comparison.entry("value", (row, 0), *expected, found, expected.abs().max(1e-6), 0.0);
        }
        let jacobian = Jacobian { data: &mut data, columns: &columns, width };
        for (column, &(k, i)) in coordinates.iter().enumerate() {
            if jacobian.wanted_coordinate(k, i) {
                for row in 0..rows {
                    let (derivative, error) = expected[column][row];
                    let found = jacobian.data[row * width + columns[k].start + i];
                    let size = derivative.abs().max(found.abs()).max(1e-3 * largest[row]);
                    comparison.entry(what, (row, column), derivative, found, size, error);
                }
            }
        }
    };
    judge("Jacobian", &vec![Coordinates::All; stored.len()]);
    for &(k, i) in &coordinates {
        let only = [i as u16];
        let mut free = vec![Coordinates::None; stored.len()];
        free[k] = Coordinates::Some(&only);
        judge("Jacobian with one free coordinate", &free);
    }
    comparison.finish()
}

fn layout<'a>(stored: &[(Vec<f64>, usize)], free: &[Coordinates<'a>]) -> (Vec<Columns<'a>>, usize) {
    let mut width = 0;
    let columns = stored
        .iter()
        .zip(free)
        .map(|(&(_, len), &free)| {
            width += len;
            let active = match free {
                Coordinates::None => 0,
                Coordinates::All => len,
                Coordinates::Some(free) => free.len(),
            };
            Columns { start: width - len, len, active, free }
        })
        .collect();
    (columns, width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Pose, Scalar, Vector};
    use nalgebra::Vector3;

    struct Transform;
    impl Function for Transform {
        type On = (Pose, Pose);
        type Output = Pose;
        fn compute<T: Scalar>(&self, (a, b): (Pose<T>, Pose<T>)) -> Pose<T> {
            a * b
        }
    }

    /// Distance from the origin, with a Jacobian by hand whose sign may be wrong.
    struct Length(f64);
    impl Factor<1> for Length {
        type On = (Vector<2>,);
        fn residual<T: Scalar>(&self, (p,): (Vector<2, T>,)) -> [T; 1] {
            [p.norm()]
        }
        fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 1] {
            let length = x[0][0].hypot(x[0][1]);
            if let Some(jacobian) = jacobian {
                let row = jacobian.row(0, 0);
                (row[0], row[1]) = (x[0][0] / length, self.0 * x[0][1] / length);
            }
            [length]
        }
    }

    #[test]
    fn a_function_of_poses_passes() {
        let pose = |s: f64| Pose::new(Vector3::new(0.4, -0.2 * s, 1.1), Vector3::new(s, 2.0, -0.5));
        let agreement = function(&Transform, &(pose(1.0), pose(-2.0))).unwrap();
        assert!(agreement.entries > 6 * 12 && agreement.worst < 0.1, "{agreement:?}");
    }

    #[test]
    fn a_wrong_jacobian_is_named_with_its_entry() {
        let at = (Vector::<2>::new(3.0, 4.0),);
        assert!(factor(&Length(1.0), &at).is_ok());
        let mismatch = factor(&Length(-1.0), &at).unwrap_err();
        assert_eq!((mismatch.row, mismatch.column), (0, 1));
        assert!((mismatch.expected - 0.8).abs() < 1e-9 && (mismatch.found + 0.8).abs() < 1e-9, "{mismatch}");
    }
}
