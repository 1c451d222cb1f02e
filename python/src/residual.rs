//! A residual that a Python function computes.
use crate::arrays::{Floats, fixed};
use crate::errors::unusable;
use crate::node::Kind;
use handeye::solvers::{DynamicFactor, Jacobian};
use numpy::ndarray::Ix2;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::{Arc, Mutex, PoisonError};

/// What is called.
pub struct Functions {
    pub residual: Py<PyAny>,
    /// Its derivatives, where they are given.
    pub jacobian: Option<Py<PyAny>>,
}

/// The functions and what they are on.
pub struct Residual {
    functions: Arc<Functions>,
    kinds: Vec<Kind>,
    rows: usize,
    /// What the functions of a graph have raised.
    raised: Arc<Mutex<Option<PyErr>>>,
}

impl Residual {
    pub fn new(functions: Arc<Functions>, kinds: Vec<Kind>, raised: &Arc<Mutex<Option<PyErr>>>) -> Self {
        Residual { functions, kinds, rows: 0, raised: raised.clone() }
    }

    /// How many rows the residual has, and, where derivatives are given, that these are of the right shape.
    pub fn count(&mut self, py: Python<'_>, values: Vec<Bound<'_, PyAny>>) -> PyResult<usize> {
        let values = PyTuple::new(py, values)?;
        let r: Floats<'_> = self.functions.residual.call1(py, values.clone())?.extract(py)?;
        let view = r.as_array();
        if view.ndim() > 1 || view.is_empty() {
            return Err(unusable(format!("a residual of shape {:?}, and a number or (rows,) would do", view.shape())));
        }
        self.rows = view.len();
        if self.functions.jacobian.is_some() {
            self.slopes(py, values, |_, _, _| {})?;
        }
        Ok(self.rows)
    }

    fn arguments<'py>(&self, py: Python<'py>, x: &[&[f64]]) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.kinds.iter().zip(x).map(|(kind, x)| kind.to_python(py, x)))
    }

    fn call(&self, py: Python<'_>, values: Bound<'_, PyTuple>, r: &mut [f64]) -> PyResult<()> {
        let given: Floats<'_> = self.functions.residual.call1(py, values)?.extract(py)?;
        let view = given.as_array();
        if view.len() != r.len() || view.ndim() > 1 {
            return Err(unusable(format!("a residual of shape {:?}, which had {} rows before", view.shape(), r.len())));
        }
        r.iter_mut().zip(view.iter()).for_each(|(r, given)| *r = *given);
        Ok(())
    }

    /// Calls `each(row, column, slope)` for the derivatives by the steps of all arguments side by side.
    fn slopes(
        &self,
        py: Python<'_>,
        values: Bound<'_, PyTuple>,
        mut each: impl FnMut(usize, usize, f64),
    ) -> PyResult<()> {
        let Some(jacobian) = &self.functions.jacobian else { return Ok(()) };
        let width: usize = self.kinds.iter().map(|kind| kind.tangent()).sum();
        let shape = format!("({}, {width})", self.rows);
        let given: Floats<'_> = jacobian.call1(py, values)?.extract(py)?;
        let view = given.as_array();
        if self.rows == 1 && view.shape() == [width] {
            (0..width).for_each(|column| each(0, column, view[[column]]));
            return Ok(());
        }
        let view = fixed::<Ix2>("jacobian", view, &shape)?;
        if view.shape() != [self.rows, width] {
            return Err(unusable(format!("jacobian: shape {:?}, and {shape} would do", view.shape())));
        }
        view.indexed_iter().for_each(|((row, column), slope)| each(row, column, *slope));
        Ok(())
    }

    /// True where nothing was raised.
    fn noted(&self, done: PyResult<()>) -> bool {
        let Err(error) = done else { return true };
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        false
    }

    /// After something was raised, nothing more is asked of Python.
    fn is_over(&self) -> bool {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
}

impl DynamicFactor for Residual {
    fn residual(&self, x: &[&[f64]], r: &mut [f64]) {
        let mut call = || Python::attach(|py| self.call(py, self.arguments(py, x)?, r));
        if self.is_over() || !self.noted(call()) {
            r.fill(f64::NAN);
        }
    }

    fn linearize(&self, x: &[&[f64]], r: &mut [f64], jacobian: &mut Jacobian<'_>) -> bool {
        if self.functions.jacobian.is_none() {
            return false;
        }
        DynamicFactor::residual(self, x, r);
        // Column by argument and coordinate.
        let places: Vec<(usize, usize)> =
            self.kinds.iter().enumerate().flat_map(|(k, kind)| (0..kind.tangent()).map(move |i| (k, i))).collect();
        let write = |row: usize, column: usize, slope: f64| {
            let (argument, coordinate) = places[column];
            if jacobian.wanted(argument) {
                jacobian.row(row, argument)[coordinate] = slope;
            }
        };
        let done =
            if self.is_over() { Ok(()) } else { Python::attach(|py| self.slopes(py, self.arguments(py, x)?, write)) };
        if !self.noted(done) {
            r.fill(f64::NAN);
        }
        true
    }
}
