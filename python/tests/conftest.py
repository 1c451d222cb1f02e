"""What several tests begin with."""

import numpy as np
import pytest

import handeye


@pytest.fixture(scope="session")
def ur5():
    return handeye.Rig.load("ur5")


@pytest.fixture(scope="session")
def motions(ur5):
    return handeye.simulate(ur5, samples=50, seed=1).recording


@pytest.fixture(scope="session")
def fresh(ur5):
    return handeye.simulate(ur5, samples=50, seed=2).recording


@pytest.fixture(scope="session")
def learned(motions):
    return handeye.calibrate(motions)


@pytest.fixture()
def random():
    return np.random.default_rng(1)
