"""Least squares in one call, for residuals of one's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import NotDone
from ._handeye import Graph


@dataclass(frozen=True)
class Minimum:
    """Where ``minimize`` ended."""

    x: NDArray[np.float64]
    """The minimum, shape (n,)."""
    cost: float
    """Sum of rho(|r / sigma|²) / 2 there."""
    covariance: NDArray[np.float64] | None
    """Covariance of x, (n, n); ``None`` where the residuals leave a direction open."""
    converged: bool
    """True where a minimum was reached, as far as can be told."""
    iterations: int
    """Steps tried."""
    termination: str
    """Why it stopped, in words."""


def minimize(
    residual: Callable[[NDArray[np.float64]], ArrayLike],
    x0: ArrayLike,
    *,
    sigma: ArrayLike | None = None,
    loss: str = "squared",
    width: float = 1.0,
    jacobian: Callable[[NDArray[np.float64]], ArrayLike] | None = None,
    prior: tuple[ArrayLike, ArrayLike] | None = None,
    max_iterations: int = 100,
    cost_tolerance: float = 1e-10,
) -> Minimum:
    """Minimises sum rho(|residual(x) / sigma|²) / 2 from x0 on, shape (n,).

    residual: ``residual(x)``, shape (rows,). jacobian: ``jacobian(x)``, (rows, n); central differences where left out. sigma: standard
    deviation of all rows, or of each. loss, width: as ``Graph.factor`` has them, of all rows together; a robust loss for each row takes
    a factor each. prior: (mean, standard deviations) of a Gaussian around x, infinite where nothing is known. What the functions raise
    is raised here.
    """
    graph = Graph()
    node = graph.vector(x0)
    graph.factor(residual, node, sigma=sigma, loss=loss, width=width, jacobian=jacobian)
    if prior is not None:
        graph.prior(node, *prior)
    done = graph.minimize(max_iterations=max_iterations, cost_tolerance=cost_tolerance)
    try:
        covariance = graph.covariance(node)
    except NotDone:
        covariance = None
    return Minimum(graph.value(node), done.final_cost, covariance, done.converged, done.iterations, done.termination)
