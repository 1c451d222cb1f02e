"""Residuals of one's own: against closed forms, NumPy and figures of NIST."""

import gc
import weakref

import numpy as np
import pytest

import handeye


def test_a_straight_line_is_the_one_of_linear_algebra(random):
    x = np.linspace(0, 1, 30)
    sigma = 0.01 + 0.02 * x
    y = 2.0 * x - 0.7 + sigma * random.normal(size=30)
    design = np.c_[x, np.ones(30)]
    found = handeye.minimize(lambda p: design @ p - y, [0.0, 0.0], sigma=sigma)
    weighted = design / sigma[:, None]
    information = weighted.T @ weighted
    np.testing.assert_allclose(found.x, np.linalg.solve(information, weighted.T @ (y / sigma)), rtol=1e-7)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-6)
    assert found.converged and found.cost == pytest.approx(0.5 * np.sum(((design @ found.x - y) / sigma) ** 2), rel=1e-9)


# NIST's Misra1a, whose certified values are b1 = 2.3894212918E+02, b2 = 5.5015643181E-04, residual sum of squares 1.2455138894E-01.
MISRA_X = np.array([77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0])
MISRA_Y = np.array([10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78])


@pytest.mark.parametrize("start", [(500.0, 1e-4), (250.0, 5e-4)])
def test_misra1a_is_what_nist_certifies(start):
    def residual(b):
        return b[0] * (1 - np.exp(-b[1] * MISRA_X)) - MISRA_Y

    def jacobian(b):
        decay = np.exp(-b[1] * MISRA_X)
        return np.c_[1 - decay, b[0] * MISRA_X * decay]

    found = handeye.minimize(residual, start, jacobian=jacobian, cost_tolerance=1e-16)
    np.testing.assert_allclose(found.x, [2.3894212918e02, 5.5015643181e-04], rtol=1e-8)
    assert 2 * found.cost == pytest.approx(1.2455138894e-01, rel=1e-9)


def turn(w):
    """exp of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(w)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    if angle == 0.0:
        return np.eye(3)
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def test_points_on_a_body_give_its_pose_as_the_closed_form_has_it(random):
    truth = np.eye(4)
    truth[:3, :3], truth[:3, 3] = turn(np.array([0.4, -2.0, 0.8])), [0.3, -0.2, 1.1]
    body = random.normal(size=(20, 3))
    seen = body @ truth[:3, :3].T + truth[:3, 3] + random.normal(0, 0.01, (20, 3))
    graph = handeye.Graph()
    pose = graph.pose(np.eye(4))
    for point, where in zip(body, seen):
        graph.factor(lambda t, point=point, where=where: t[:3, :3] @ point + t[:3, 3] - where, pose, sigma=0.01)
    done = graph.minimize()
    # Kabsch: the rotation is that of the singular vectors, the translation joins the centroids.
    u, _, vt = np.linalg.svd((seen - seen.mean(0)).T @ (body - body.mean(0)))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    found = graph.value(pose)
    np.testing.assert_allclose(found[:3, :3], rotation, atol=1e-6)
    np.testing.assert_allclose(found[:3, 3], seen.mean(0) - rotation @ body.mean(0), atol=1e-6)
    assert done.converged and graph.cost == done.final_cost < done.initial_cost
    # The translation about the centroid is as certain as the mean of 20 points.
    covariance = graph.covariance(pose)
    assert np.sqrt(np.linalg.eigvalsh(covariance)[0]) <= 0.01 / np.sqrt(20) * 1.001


def test_a_prior_and_a_measurement_share_by_their_precision():
    graph = handeye.Graph()
    x, scale = graph.vector([0.0, 0.0]), graph.vector(2.0, held=True)
    graph.factor(lambda x, scale: scale * x - [4.0, 8.0], (x, scale), sigma=[1.0, 2.0])
    graph.prior(x, [1.0, 1.0], [0.5, np.inf])
    graph.minimize()
    # Of the first: 2 ± 1/2 and 1 ± 1/2; of the second: 4 alone.
    np.testing.assert_allclose(graph.value(x), [1.5, 4.0], rtol=1e-9)
    np.testing.assert_allclose(graph.covariance(x), np.diag([0.125, 1.0]), rtol=1e-8)
    assert graph.value(scale) == 2.0


def test_a_robust_loss_leaves_a_wrong_reading_out():
    readings = [1.0, 1.1, 0.9, 1.05, 0.95, 50.0]
    found = {}
    for loss in ("squared", "cauchy"):
        graph = handeye.Graph()
        x = graph.vector(1.0)
        for reading in readings:
            graph.factor(lambda x, reading=reading: x - reading, x, sigma=0.1, loss=loss)
        graph.minimize()
        found[loss] = graph.value(x)[0]
    assert found["squared"] == pytest.approx(np.mean(readings)) and abs(found["cauchy"] - 1.0) < 0.02


def test_what_is_held_stays_and_what_is_released_moves():
    graph = handeye.Graph()
    direction, rotation = graph.direction([0, 0, 2.0]), graph.rotation(np.eye(3))
    np.testing.assert_array_equal(graph.value(direction), [0, 0, 1])
    graph.factor(lambda d, r: r @ d - [0.6, 0.0, 0.8], (direction, rotation))
    graph.hold(direction)
    graph.prior(rotation, np.eye(3), 10.0)
    graph.minimize()
    np.testing.assert_array_equal(graph.value(direction), [0, 0, 1])
    np.testing.assert_allclose(graph.value(rotation)[:, 2], [0.6, 0.0, 0.8], atol=0.01)
    graph.release(direction)
    graph.hold(rotation, [0, 1, 2])
    graph.set(rotation, np.eye(3))
    graph.minimize()
    np.testing.assert_allclose(graph.value(direction), [0.6, 0.0, 0.8], atol=1e-6)


def test_what_a_residual_raises_is_raised():
    calls = []

    def fails(x):
        calls.append(x)
        if len(calls) > 3:
            raise ZeroDivisionError("not here")
        return x - 1.0

    with pytest.raises(ZeroDivisionError, match="not here"):
        handeye.minimize(fails, [0.0, 0.0])
    assert len(calls) == 4, "nothing more is asked after that"


def test_shapes_are_told_in_words():
    graph = handeye.Graph()
    x = graph.vector([0.0, 0.0])
    for wrong, message in [
        (lambda: graph.factor(lambda x: np.zeros((2, 2)), x), r"a residual of shape \[2, 2\], and a number or \(rows,\) would do"),
        (lambda: graph.factor(lambda x: x, x, jacobian=lambda x: np.eye(3)), r"jacobian: shape \[3, 3\], and \(2, 2\) would do"),
        (lambda: graph.factor(lambda x: x, x, sigma=[1.0, 0.0]), "standard deviations are above 0"),
        (lambda: graph.factor(lambda x: x, x, loss="l1"), r"loss: unknown `l1` \(known: squared, huber"),
        (lambda: graph.factor(lambda *x: x[0], [x] * 9), "a factor is on 1 to 8 nodes, found 9"),
        (lambda: graph.prior(x, [0.0], 1.0), r"mean: shape \[1\], and \(2,\) would do"),
        (lambda: handeye.Graph().value(x), "is of another graph"),
    ]:
        with pytest.raises(handeye.UnusableInput, match=message):
            wrong()
    with pytest.raises(handeye.NotDone, match="nothing to estimate"):
        handeye.Graph().minimize()


def test_a_node_of_another_graph_is_refused_even_where_there_is_one_like_it():
    graph, other = handeye.Graph(), handeye.Graph()
    x, y = graph.vector([1.0, 2.0]), other.vector([3.0, 4.0])
    for wrong in (lambda: graph.value(y), lambda: graph.factor(lambda y: y, y), lambda: graph.prior(y, [0.0, 0.0], 1.0)):
        with pytest.raises(handeye.UnusableInput, match="is of another graph"):
            wrong()
    np.testing.assert_array_equal(graph.value(x), [1.0, 2.0])


class Owner:
    """Holds the graph that calls it: a cycle that only the collector sees."""

    def __init__(self):
        self.graph = handeye.Graph()
        self.x = self.graph.vector([0.0])
        self.graph.factor(self.residual, self.x, jacobian=self.slope)

    def residual(self, x):
        return x - 1.0

    def slope(self, x):
        return np.ones((1, 1))


def test_a_graph_that_calls_its_owner_works_and_is_collected():
    owner = Owner()
    owner.graph.minimize()
    np.testing.assert_allclose(owner.graph.value(owner.x), [1.0])
    is_there = weakref.ref(owner)
    del owner
    gc.collect()
    assert is_there() is None
