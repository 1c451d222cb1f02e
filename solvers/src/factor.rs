//! What users write: residuals on variables, and functions that derive one variable from others.
use crate::jacobian::{Columns, Coordinates, Jacobian, forward};
use crate::scalar::Dual;
use crate::{Scalar, Variable, Variables};
use nalgebra::DMatrix;

/// Steps of derived nodes up to this length are kept on the stack.
const SHORT: usize = 12;

/// A residual r(x) in R^M on a tuple of variables.
///
/// Only `residual` is needed: it is written once over the scalar, and its Jacobian follows by forward mode.
///
/// ```
/// use handeye_solvers::{Factor, Graph, LevenbergMarquardt, Scalar, Vector};
/// struct Distance(f64);
/// impl Factor<1> for Distance {
///     type On = (Vector<2>, Vector<2>);
///     fn residual<T: Scalar>(&self, (a, b): (Vector<2, T>, Vector<2, T>)) -> [T; 1] {
///         [(a - b).norm() - self.0]
///     }
/// }
/// let mut graph = Graph::new();
/// let origin = graph.held(Vector::<2>::zeros());
/// let point = graph.free(Vector::<2>::new(1.0, 1.0));
/// graph.factor(Distance(5.0), (origin, point)).sigma(0.1);
/// LevenbergMarquardt::default().minimize(&mut graph)?;
/// assert!((graph.value(point).norm() - 5.0).abs() < 1e-9);
/// # Ok::<(), handeye_solvers::Error>(())
/// ```
pub trait Factor<const M: usize>: Send + Sync + 'static {
    /// The variables it is on, such as `(Pose, Vector<3>)`.
    type On: Variables;

    /// The residual, before noise and loss.
    fn residual<T: Scalar>(&self, on: <Self::On as Variables>::Over<T>) -> [T; M];

    /// The residual and, where wanted, its Jacobian, from the arguments as they are stored.
    ///
    /// To be overridden for speed alone, by a factor whose derivatives are known; [`crate::check::factor`] compares the two.
    #[inline]
    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; M] {
        match jacobian {
            None => self.residual(<Self::On as Variables>::seed(x, |_, _| 0.0)),
            Some(jacobian) => {
                let mut r = [Dual::from(0.0); M];
                forward::<Self::On>(x, jacobian, &mut r, |on, r| r.copy_from_slice(&self.residual(on)));
                r.map(|value| value.value())
            }
        }
    }

    /// The residual at the given variables and its Jacobian, outside a graph: for each variable, M rows and one column per
    /// coordinate of its step.
    fn linearize(&self, at: &Self::On) -> ([f64; M], Vec<DMatrix<f64>>) {
        let stored = at.stored();
        let x: Vec<&[f64]> = stored.iter().map(|(x, _)| x.as_slice()).collect();
        let mut width = 0;
        let columns: Vec<Columns<'_>> = stored
            .iter()
            .map(|&(_, len)| {
                width += len;
                Columns { start: width - len, len, active: len, free: Coordinates::All }
            })
            .collect();
        let mut data = vec![0.0; M * width];
        let r = self.evaluate(&x, Some(&mut Jacobian { data: &mut data, columns: &columns, width }));
        let block = |c: &Columns<'_>| DMatrix::from_fn(M, c.len, |row, k| data[row * width + c.start + k]);
        (r, columns.iter().map(block).collect())
    }
}

/// A function that derives one variable from others: a deterministic node of the graph.
pub trait Function: Send + Sync + 'static {
    /// The variables it takes.
    type On: Variables;
    /// The variable it gives.
    type Output: Variable<Over<f64> = Self::Output>;

    /// The derived variable.
    fn compute<T: Scalar>(&self, on: <Self::On as Variables>::Over<T>) -> <Self::Output as Variable>::Over<T>;

    /// Writes the derived variable as it is stored to `y` and, where wanted, the derivative of its step.
    ///
    /// To be overridden for speed alone; [`crate::check::function`] compares the two.
    fn evaluate(&self, x: &[&[f64]], y: &mut [f64], jacobian: Option<&mut Jacobian<'_>>) {
        let value = self.compute(<Self::On as Variables>::seed(x, |_, _| 0.0));
        Self::Output::store(&value, y);
        if let Some(jacobian) = jacobian {
            let tangent = value.tangent();
            let (mut short, mut long) = ([Dual::from(0.0); SHORT], Vec::new());
            let step = if tangent <= SHORT {
                &mut short[..tangent]
            } else {
                long.resize(tangent, Dual::from(0.0));
                &mut long[..]
            };
            forward::<Self::On>(x, jacobian, step, |on, step| Self::Output::local(y, &self.compute(on), step));
        }
    }
}
