//! Least squares with residuals of one's own: `Graph` and `minimize`.
use crate::arrays::{Floats, list, matrix, pose};
use crate::errors::{not_done, raise, unusable};
use crate::minimization::Minimization;
use crate::node::{GraphId, Handle, Kind, Node, Nodes, direction_of, rotation_of, vector_of};
use crate::residual::{Functions, Residual};
use handeye::solvers::{self, AnyKey, Covariance, Iteration, LevenbergMarquardt, Loss, Solver};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

/// A least-squares problem with residuals of one's own as Python functions: for prototypes.
///
/// Nodes are what is estimated: vectors, poses, rotations, directions. Factors are residuals on one to eight of them, whitened by
/// standard deviations, with a robust loss where wanted; derivatives are taken by central differences where none are given. Priors are
/// Gaussian. ``minimize`` moves the free nodes to a minimum of sum rho(|r / sigma|²) / 2.
///
/// Steps, in which standard deviations of priors, Jacobians and covariances are counted: of a vector, what is added; of a pose, a rotation
/// vector w [rad] and a translation v [m] in the parent's frame, R -> exp(w) R, t -> t + v; of a rotation, w; of a direction, two angles.
#[pyclass(module = "handeye")]
#[derive(Default)]
pub struct Graph {
    inner: solvers::Graph,
    nodes: Vec<Handle>,
    /// Those of the factors, which `inner` has too.
    functions: Vec<Arc<Functions>>,
    raised: Arc<Mutex<Option<PyErr>>>,
    id: GraphId,
}

#[pymethods]
impl Graph {
    #[new]
    fn new() -> Self {
        Graph::default()
    }

    /// Adds a vector, shape (n,), that is estimated from ``start`` on. held: stays where it is. A number is a vector of one.
    #[pyo3(signature = (start, *, held = false))]
    fn vector(&mut self, start: Floats<'_>, held: bool) -> PyResult<Node> {
        let value = vector_of("start", start.as_array(), None)?;
        let n = value.len();
        let key = if held { self.inner.held(value) } else { self.inner.free(value) };
        Ok(self.add(Handle::Vector(key), Kind::Vector(n)))
    }

    /// Adds a pose, (4, 4).
    #[pyo3(signature = (start, *, held = false))]
    fn pose(&mut self, start: Floats<'_>, held: bool) -> PyResult<Node> {
        let value = pose("start", start.as_array())?;
        let key = if held { self.inner.held(value) } else { self.inner.free(value) };
        Ok(self.add(Handle::Pose(key), Kind::Pose))
    }

    /// Adds a rotation matrix, (3, 3).
    #[pyo3(signature = (start, *, held = false))]
    fn rotation(&mut self, start: Floats<'_>, held: bool) -> PyResult<Node> {
        let value = rotation_of("start", &start)?;
        let key = if held { self.inner.held(value) } else { self.inner.free(value) };
        Ok(self.add(Handle::Rotation(key), Kind::Rotation))
    }

    /// Adds a unit vector, (3,); its length does not matter.
    #[pyo3(signature = (start, *, held = false))]
    fn direction(&mut self, start: Floats<'_>, held: bool) -> PyResult<Node> {
        let value = direction_of("start", &start)?;
        let key = if held { self.inner.held(value) } else { self.inner.free(value) };
        Ok(self.add(Handle::Direction(key), Kind::Direction))
    }

    /// Adds a factor: ``residual(*values)`` of the nodes that it is on, a number or shape (rows,).
    ///
    /// sigma: standard deviation of all rows, or of each, (rows,), in the residual's unit. loss: ``"squared"``, ``"huber"``, ``"cauchy"`` or
    /// ``"geman-mcclure"``, of a width in standard deviations. jacobian: ``jacobian(*values)``, the derivatives by the steps of all nodes
    /// side by side, (rows, steps); central differences where left out. What either raises, ``minimize`` raises.
    #[pyo3(signature = (residual, on, *, sigma = None, loss = "squared", width = 1.0, jacobian = None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per setting")]
    fn factor(
        &mut self,
        py: Python<'_>,
        residual: Py<PyAny>,
        on: Nodes<'_>,
        sigma: Option<Floats<'_>>,
        loss: &str,
        width: f64,
        jacobian: Option<Py<PyAny>>,
    ) -> PyResult<()> {
        let nodes: Vec<Node> = match on {
            Nodes::One(node) => vec![*node.get()],
            Nodes::Several(nodes) => nodes.iter().map(|node| *node.get()).collect(),
        };
        let keys: Vec<AnyKey> = nodes.iter().map(|node| self.any(node)).collect::<PyResult<_>>()?;
        let loss = loss_of(loss, width)?;
        let functions = Arc::new(Functions { residual, jacobian });
        let kinds = nodes.iter().map(|node| node.kind).collect();
        let mut residual = Residual::new(functions.clone(), kinds, &self.raised);
        let values: Vec<Bound<'_, PyAny>> = nodes.iter().map(|node| self.read(py, node)).collect::<PyResult<_>>()?;
        let rows = residual.count(py, values)?;
        let sigmas = match sigma {
            None => vec![1.0; rows],
            Some(sigma) if sigma.as_array().ndim() == 0 => vec![sigma.as_array()[[]]; rows],
            Some(sigma) => list("sigma", &sigma, rows)?,
        };
        if !sigmas.iter().all(|sigma| *sigma > 0.0) {
            return Err(unusable("sigma: standard deviations are above 0"));
        }
        let settings = self.inner.dynamic_factor(residual, rows, &keys);
        settings.map_err(|error| unusable(error.to_string()))?.sigmas(&sigmas).loss(loss);
        self.functions.push(functions);
        Ok(())
    }

    /// Adds a Gaussian prior: the step from ``mean`` to the node has these standard deviations, one for all or one per coordinate of the
    /// step; infinite where nothing is known.
    fn prior(&mut self, node: &Bound<'_, Node>, mean: Floats<'_>, sigma: Floats<'_>) -> PyResult<()> {
        let node = *node.get();
        let n = node.kind.tangent();
        let view = sigma.as_array();
        let sigmas = if view.ndim() == 0 { vec![view[[]]; n] } else { list("sigma", &sigma, n)? };
        if !sigmas.iter().all(|sigma| *sigma > 0.0) {
            return Err(unusable("sigma: standard deviations are above 0"));
        }
        match self.handle(&node)? {
            Handle::Vector(key) => self.inner.prior(key, &vector_of("mean", mean.as_array(), Some(n))?, &sigmas),
            Handle::Pose(key) => self.inner.prior(key, &pose("mean", mean.as_array())?, &sigmas),
            Handle::Rotation(key) => self.inner.prior(key, &rotation_of("mean", &mean)?, &sigmas),
            Handle::Direction(key) => self.inner.prior(key, &direction_of("mean", &mean)?, &sigmas),
        };
        Ok(())
    }

    /// Where a node is now.
    fn value<'py>(&self, py: Python<'py>, node: &Bound<'py, Node>) -> PyResult<Bound<'py, PyAny>> {
        self.read(py, node.get())
    }

    /// Moves a node.
    fn set(&mut self, node: &Bound<'_, Node>, value: Floats<'_>) -> PyResult<()> {
        let node = node.get();
        match self.handle(node)? {
            Handle::Vector(key) => {
                let value = vector_of("value", value.as_array(), Some(node.kind.tangent()))?;
                self.inner.set(key, &value);
            }
            Handle::Pose(key) => self.inner.set(key, &pose("value", value.as_array())?),
            Handle::Rotation(key) => self.inner.set(key, &rotation_of("value", &value)?),
            Handle::Direction(key) => self.inner.set(key, &direction_of("value", &value)?),
        }
        Ok(())
    }

    /// Holds a node where it is; with ``coordinates``, only those of its step.
    #[pyo3(signature = (node, coordinates = None))]
    fn hold(&mut self, node: &Bound<'_, Node>, coordinates: Option<Vec<usize>>) -> PyResult<()> {
        let n = node.get().kind.tangent();
        let Some(coordinates) = coordinates else {
            match self.handle(node.get())? {
                Handle::Vector(key) => self.inner.hold(key),
                Handle::Pose(key) => self.inner.hold(key),
                Handle::Rotation(key) => self.inner.hold(key),
                Handle::Direction(key) => self.inner.hold(key),
            }
            return Ok(());
        };
        if let Some(wrong) = coordinates.iter().find(|coordinate| **coordinate >= n) {
            return Err(unusable(format!("coordinates: {wrong}, and a step has {n}")));
        }
        match self.handle(node.get())? {
            Handle::Vector(key) => self.inner.hold_coordinates(key, &coordinates),
            Handle::Pose(key) => self.inner.hold_coordinates(key, &coordinates),
            Handle::Rotation(key) => self.inner.hold_coordinates(key, &coordinates),
            Handle::Direction(key) => self.inner.hold_coordinates(key, &coordinates),
        }
        Ok(())
    }

    /// Frees a node that was held.
    fn release(&mut self, node: &Bound<'_, Node>) -> PyResult<()> {
        match self.handle(node.get())? {
            Handle::Vector(key) => self.inner.release(key),
            Handle::Pose(key) => self.inner.release(key),
            Handle::Rotation(key) => self.inner.release(key),
            Handle::Direction(key) => self.inner.release(key),
        }
        Ok(())
    }

    /// Sum of rho(|r / sigma|²) / 2 over all factors, where the nodes are now.
    #[getter]
    fn cost(&self, py: Python<'_>) -> PyResult<f64> {
        let graph = &self.inner;
        let cost = py.detach(|| graph.cost());
        self.check()?;
        Ok(cost)
    }

    /// Moves the free nodes to a minimum (Levenberg-Marquardt).
    ///
    /// max_iterations: most steps that are tried. cost_tolerance: stops where a step lowers the cost by less than this share. Ctrl-C ends
    /// it; the best values so far are kept.
    ///
    /// Raises ``NotDone`` where nothing is free, or a residual is not finite at the start.
    #[pyo3(signature = (*, max_iterations = 100, cost_tolerance = 1e-10))]
    fn minimize(&mut self, py: Python<'_>, max_iterations: usize, cost_tolerance: f64) -> PyResult<Minimization> {
        let minimizer = LevenbergMarquardt { max_iterations, cost_tolerance, ..LevenbergMarquardt::default() };
        let (graph, raised) = (&mut self.inner, &self.raised);
        let report = py.detach(|| {
            let mut observer = |_: &Iteration| {
                let signalled = Python::attach(|py| py.check_signals());
                let mut raised = raised.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                if let Err(error) = signalled {
                    raised.get_or_insert(error);
                }
                if raised.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let mut solver = Solver::new(graph);
            minimizer.minimize_with(graph, &mut solver, &mut observer)
        });
        self.check()?;
        Ok(report.map_err(handeye::Error::from).map_err(raise)?.into())
    }

    /// Covariance of a node's step where the nodes are now (Laplace's approximation), shape (steps, steps).
    ///
    /// Raises ``NotDone`` where the data leave a node open.
    fn covariance<'py>(&self, py: Python<'py>, node: &Bound<'py, Node>) -> PyResult<Bound<'py, PyAny>> {
        let handle = self.handle(node.get())?;
        let graph = &self.inner;
        let found = py.detach(|| {
            let mut covariance = Covariance::new(graph)?;
            Ok(match handle {
                Handle::Vector(key) => covariance.of(key),
                Handle::Pose(key) => covariance.of(key),
                Handle::Rotation(key) => covariance.of(key),
                Handle::Direction(key) => covariance.of(key),
            })
        });
        self.check()?;
        let found = found.map_err(|error: solvers::Error| not_done(error.to_string()))?;
        Ok(matrix(py, &found).into_any())
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        self.functions.iter().try_for_each(|functions| {
            visit.call(&functions.residual)?;
            visit.call(&functions.jacobian)
        })
    }

    fn __clear__(&mut self) {
        *self = Graph::default();
    }

    fn __repr__(&self) -> String {
        format!("<handeye.Graph {} nodes, {} factors>", self.nodes.len(), self.inner.factor_count())
    }
}

impl Graph {
    fn add(&mut self, handle: Handle, kind: Kind) -> Node {
        self.nodes.push(handle);
        Node { index: self.nodes.len() - 1, kind, graph: self.id }
    }

    fn handle(&self, node: &Node) -> PyResult<Handle> {
        let found = self.nodes.get(node.index).copied().filter(|_| node.graph == self.id);
        found.ok_or_else(|| unusable(format!("{} is of another graph", node.__repr__())))
    }

    fn any(&self, node: &Node) -> PyResult<AnyKey> {
        Ok(match self.handle(node)? {
            Handle::Vector(key) => key.into(),
            Handle::Pose(key) => key.into(),
            Handle::Rotation(key) => key.into(),
            Handle::Direction(key) => key.into(),
        })
    }

    fn read<'py>(&self, py: Python<'py>, node: &Node) -> PyResult<Bound<'py, PyAny>> {
        use handeye::solvers::Variable;
        fn stored<V: Variable<Over<f64> = V>>(value: &V) -> Vec<f64> {
            let mut x = vec![0.0; value.ambient()];
            V::store(value, &mut x);
            x
        }
        let x = match self.handle(node)? {
            Handle::Vector(key) => stored(&self.inner.value(key)),
            Handle::Pose(key) => stored(&self.inner.value(key)),
            Handle::Rotation(key) => stored(&self.inner.value(key)),
            Handle::Direction(key) => stored(&self.inner.value(key)),
        };
        Ok(node.kind.to_python(py, &x))
    }

    /// Raises what a function has raised meanwhile.
    fn check(&self) -> PyResult<()> {
        let mut raised = self.raised.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        raised.take().map_or(Ok(()), Err)
    }
}

fn loss_of(name: &str, width: f64) -> PyResult<Loss> {
    if width.is_nan() || width <= 0.0 {
        return Err(unusable(format!("width: {width} standard deviations, and it has to be above 0")));
    }
    match name {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber(width)),
        "cauchy" => Ok(Loss::Cauchy(width)),
        "geman-mcclure" => Ok(Loss::GemanMcClure(width)),
        _ => Err(unusable(format!("loss: unknown `{name}` (known: squared, huber, cauchy, geman-mcclure)"))),
    }
}
