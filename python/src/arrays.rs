//! Numbers from and to numpy.
use crate::errors::unusable;
use handeye::solvers::Pose;
use nalgebra::{DMatrix, Matrix3, Vector3};
use numpy::ndarray::{Array, ArrayView, ArrayViewD, Dimension, Ix1, IxDyn};
use numpy::{AllowTypeChange, IntoPyArray, PyArray, PyArrayDyn, PyArrayLikeDyn};
use pyo3::prelude::*;

/// Whatever numpy makes an array of floats from.
pub type Floats<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// A new array of numpy's own.
pub type NewArray<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Numbers row by row as an array of a shape, which has to have as many places.
pub fn array<'py>(py: Python<'py>, shape: &[usize], numbers: Vec<f64>) -> NewArray<'py> {
    Array::from_shape_vec(IxDyn(shape), numbers).expect("as many numbers as places").into_pyarray(py)
}

/// One list of numbers.
pub fn vector<'py>(py: Python<'py>, numbers: &[f64]) -> Bound<'py, PyArray<f64, Ix1>> {
    PyArray::from_slice(py, numbers)
}

/// A matrix.
pub fn matrix<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> NewArray<'py> {
    array(py, &[matrix.nrows(), matrix.ncols()], matrix.transpose().as_slice().to_vec())
}

/// A pose as a homogeneous matrix, 4 x 4.
pub fn homogeneous<'py>(py: Python<'py>, pose: &Pose) -> NewArray<'py> {
    array(py, &[4, 4], rows(pose).to_vec())
}

/// A homogeneous matrix row by row.
pub fn rows(pose: &Pose) -> [f64; 16] {
    let (r, t) = (&pose.rotation, &pose.translation);
    let mut rows = [0.0; 16];
    for i in 0..3 {
        rows[4 * i..4 * i + 3].copy_from_slice(&[r[(i, 0)], r[(i, 1)], r[(i, 2)]]);
        rows[4 * i + 3] = t[i];
    }
    rows[15] = 1.0;
    rows
}

/// How far a rotation matrix may be from one, entry by entry.
const ROTATION: f64 = 1e-6;

/// A pose from a homogeneous matrix, 4 x 4.
///
/// Errors: `UnusableInput` where it is not one: another shape, no rotation, another last row.
pub fn pose(what: &str, matrix: ArrayViewD<'_, f64>) -> PyResult<Pose> {
    if matrix.shape() != [4, 4] {
        return Err(unusable(format!(
            "{what}: a pose is a homogeneous matrix, 4 x 4, found shape {:?}",
            matrix.shape()
        )));
    }
    let at = |i: usize, j: usize| matrix[[i, j]];
    let rotation = Matrix3::from_fn(at);
    let is_rotation =
        (rotation.transpose() * rotation - Matrix3::identity()).amax() < ROTATION && rotation.determinant() > 0.0;
    if !is_rotation || [0, 1, 2].map(|j| at(3, j)) != [0.0; 3] || at(3, 3) != 1.0 {
        return Err(unusable(format!(
            "{what}: a pose is a homogeneous matrix, a rotation and a translation [m] above the row 0 0 0 1; this is none"
        )));
    }
    let translation = Vector3::from_fn(|i, _| at(i, 3));
    if !translation.iter().all(|number| number.is_finite()) {
        return Err(unusable(format!("{what}: a translation is not finite")));
    }
    Ok(Pose { rotation: nearest_rotation(&rotation), translation })
}

/// The rotation that rounding has taken a matrix away from.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => u * v_t,
        _ => *matrix,
    }
}

/// A pose, or `None` where its entries are NaN: not measured.
pub fn pose_or_none(what: &str, matrix: ArrayViewD<'_, f64>) -> PyResult<Option<Pose>> {
    if matrix.iter().all(|number| number.is_nan()) { Ok(None) } else { pose(what, matrix).map(Some) }
}

/// A list of `n` numbers.
pub fn list(what: &str, numbers: &Floats<'_>, n: usize) -> PyResult<Vec<f64>> {
    let view = numbers.as_array();
    if view.shape() != [n] {
        return Err(unusable(format!("{what}: shape {:?}, and ({n},) would do", view.shape())));
    }
    Ok(view.iter().copied().collect())
}

/// Three numbers.
pub fn three(what: &str, numbers: &Floats<'_>) -> PyResult<Vector3<f64>> {
    list(what, numbers, 3).map(|numbers| Vector3::from_column_slice(&numbers))
}

/// Rows of `n` numbers, and whether it was one row without a list around it.
pub fn rows_of(what: &str, numbers: &Floats<'_>, n: usize) -> PyResult<(Vec<Vec<f64>>, bool)> {
    let view = numbers.as_array();
    match view.shape() {
        [width] if *width == n => Ok((vec![view.iter().copied().collect()], true)),
        [_, width] if *width == n => Ok((view.outer_iter().map(|row| row.iter().copied().collect()).collect(), false)),
        shape => Err(unusable(format!("{what}: shape {shape:?}, and ({n},) or (samples, {n}) would do"))),
    }
}

/// A view as one of a fixed number of dimensions.
pub fn fixed<'a, D: Dimension>(what: &str, view: ArrayViewD<'a, f64>, shape: &str) -> PyResult<ArrayView<'a, f64, D>> {
    let found = view.shape().to_vec();
    view.into_dimensionality::<D>().map_err(|_| unusable(format!("{what}: shape {found:?}, and {shape} would do")))
}
