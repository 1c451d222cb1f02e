//! What a `Graph` estimates: its nodes, and their values from and to arrays.
use crate::arrays::{Floats, array, fixed, homogeneous, pose, three};
use crate::errors::unusable;
use handeye::solvers::{Direction, DynamicVector, Key, Pose, Rotation};
use nalgebra::{Matrix3, Vector3};
use numpy::ndarray::ArrayViewD;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// What tells graphs apart: of every new one another.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct GraphId(u64);

impl Default for GraphId {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        GraphId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// A node of a ``Graph``.
#[pyclass(module = "handeye", frozen, eq, hash)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Node {
    pub index: usize,
    pub kind: Kind,
    pub graph: GraphId,
}

/// What a node is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Kind {
    Vector(usize),
    Pose,
    Rotation,
    Direction,
}

impl Kind {
    /// What of a node is stored, as Python has it.
    pub fn to_python<'py>(self, py: Python<'py>, x: &[f64]) -> Bound<'py, PyAny> {
        match self {
            Kind::Vector(n) => array(py, &[n], x.to_vec()).into_any(),
            Kind::Pose => homogeneous(py, &Pose::from_stored(x)).into_any(),
            Kind::Rotation => {
                array(py, &[3, 3], Matrix3::from_column_slice(x).transpose().as_slice().to_vec()).into_any()
            }
            Kind::Direction => array(py, &[3], x[..3].to_vec()).into_any(),
        }
    }

    pub fn tangent(self) -> usize {
        match self {
            Kind::Vector(n) => n,
            Kind::Pose => 6,
            Kind::Rotation => 3,
            Kind::Direction => 2,
        }
    }
}

/// Where a graph of the library has it.
#[derive(Clone, Copy)]
pub enum Handle {
    Vector(Key<DynamicVector>),
    Pose(Key<Pose>),
    Rotation(Key<Rotation>),
    Direction(Key<Direction>),
}

#[pymethods]
impl Node {
    pub fn __repr__(&self) -> String {
        let kind = match self.kind {
            Kind::Vector(n) => format!("vector of {n}"),
            Kind::Pose => "pose".to_owned(),
            Kind::Rotation => "rotation".to_owned(),
            Kind::Direction => "direction".to_owned(),
        };
        format!("<handeye.Node {}: {kind}>", self.index)
    }
}

/// One node, or several.
#[derive(FromPyObject)]
pub enum Nodes<'py> {
    One(Bound<'py, Node>),
    Several(Vec<Bound<'py, Node>>),
}

/// A vector, of so many numbers where that is known.
pub fn vector_of(what: &str, view: ArrayViewD<'_, f64>, n: Option<usize>) -> PyResult<DynamicVector> {
    let is_right = view.ndim() <= 1 && n.is_none_or(|n| n == view.len());
    if !is_right || view.is_empty() {
        let wanted = n.map_or_else(|| "(n,)".to_owned(), |n| format!("({n},)"));
        return Err(unusable(format!("{what}: shape {:?}, and {wanted} would do", view.shape())));
    }
    Ok(DynamicVector::from_iterator(view.len(), view.iter().copied()))
}

/// A rotation matrix.
pub fn rotation_of(what: &str, matrix: &Floats<'_>) -> PyResult<Rotation> {
    let view = fixed::<numpy::ndarray::Ix2>(what, matrix.as_array(), "(3, 3)")?;
    if view.shape() != [3, 3] {
        return Err(unusable(format!("{what}: shape {:?}, and (3, 3) would do", view.shape())));
    }
    let mut homogeneous = numpy::ndarray::Array2::<f64>::eye(4);
    homogeneous.slice_mut(numpy::ndarray::s![..3, ..3]).assign(&view);
    Ok(Rotation(pose(what, homogeneous.view().into_dyn())?.rotation))
}

/// A vector as a direction.
pub fn direction_of(what: &str, numbers: &Floats<'_>) -> PyResult<Direction> {
    let vector: Vector3<f64> = three(what, numbers)?;
    Direction::new(vector).ok_or_else(|| unusable(format!("{what}: of length 0")))
}
