"""Settings shared by the tests of both dimensions."""

import pytest

from reference_solver import Settings

DT = 1.0 / 240.0


@pytest.fixture(params=["classical", "reference"])
def settings(request):
    return getattr(Settings, request.param)(DT)


@pytest.fixture
def reference():
    return Settings.reference(DT)


@pytest.fixture
def classical():
    return Settings.classical(DT)


@pytest.fixture
def fixed_step():
    return Settings.fixed_step(DT)
