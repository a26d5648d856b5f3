"""Models that are compiled once."""

import pytest

import lamc
from models import PENDULUM, ROOT


@pytest.fixture(scope="session")
def pendulum() -> lamc.Model:
    return lamc.load(PENDULUM)


@pytest.fixture(scope="session")
def sixbar() -> lamc.Model:
    return lamc.load(ROOT / "examples/sixbar.yaml")
