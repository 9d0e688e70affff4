"""What every scene of the catalogue owes: figure, reasons, cells that exist, checks that planted cells state."""

import random
import re

import pytest

from adapters.scene import SceneError
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE
from validation.running.plan import QUICK_DT

DT = QUICK_DT


def cells(canonical: CanonicalScene):
    """Every set of parameters that the scene declares."""
    yield from (variation.params for suite in ("quick", "full") for variation in canonical.variations(suite))
    yield canonical.representative
    yield from canonical.planted
    if canonical.searched:
        yield from (*canonical.searched.cells, *canonical.searched.held_out)
    if canonical.primary:
        yield from canonical.primary.variations(DT)


def families(checks):
    return {check.metric.partition("[")[0] for check in checks}


@pytest.mark.parametrize("name", CATALOGUE)
def test_text_of_a_scene(name):
    canonical = CATALOGUE[name]
    assert canonical.name == name and canonical.title and canonical.law
    drawn = [line for line in canonical.figure.splitlines() if line.startswith("    ")]
    assert len(drawn) >= 3, "its docstring opens with a drawing"
    for parameter in canonical.parameters:
        assert parameter.unit and parameter.because
        assert parameter.low <= parameter.default <= parameter.high


@pytest.mark.parametrize("name", CATALOGUE)
def test_judged_checks_of_declared_cells(name):
    canonical = CATALOGUE[name]
    for dimension in canonical.dimensions:
        for params in cells(canonical):
            scene = canonical.scene(dimension, params)
            assert (scene.name, scene.version, scene.dimension) == (name, canonical.version, dimension)
            assert any(check.bound is not None for check in canonical.checks(scene, DT)), params


def within(parameter, dice):
    """A value that the parameter's range admits: the default, an end, near the default or anywhere."""
    size = 10.0 * max(1.0, abs(parameter.default))
    low, high = max(parameter.low, -size), min(parameter.high, size)
    scaled = parameter.default * 10.0 ** dice.uniform(-1.0, 1.0)
    value = dice.choice([parameter.default, parameter.default, low, high, 1.0, dice.uniform(low, high), scaled])
    value = min(max(value, low), high)
    return float(round(value)) if parameter.integer else value


@pytest.mark.parametrize("name", CATALOGUE)
def test_parameter_ranges_of_every_scene_made_or_refused(name):
    """Values that no one else asks for: a scene of that size and name, or one line that says which number is wrong."""
    canonical, dice = CATALOGUE[name], random.Random(name)
    names, made = {parameter.name for parameter in canonical.parameters}, 0
    for _ in range(400):
        params = {parameter.name: within(parameter, dice) for parameter in canonical.parameters}
        dimension = dice.choice(canonical.dimensions)
        try:
            scene = canonical.scene(dimension, params)
        except SceneError as error:
            said = re.fullmatch(rf"{name}\.(\w+): [^\n]+", str(error))
            assert said is not None and said[1] in names, (params, str(error))
            continue
        made += 1
        assert (scene.name, scene.dimension) == (name, dimension) and dict(scene.params) == params
    assert made >= 4


@pytest.mark.parametrize("name", CATALOGUE)
def test_planted_faults_of_stated_checks(name):
    canonical = CATALOGUE[name]
    (dimension, *_) = canonical.dimensions
    stated = {
        family
        for variation in canonical.variations("standard")
        for family in families(canonical.checks(canonical.scene(dimension, variation.params), DT))
    }
    planted = [families(canonical.checks(canonical.scene(dimension, params), DT)) for params in canonical.planted]
    assert stated == set().union(*planted)


@pytest.mark.parametrize("name", CATALOGUE)
def test_bounds_know_the_scene_and_the_step_only(name):
    """The same cell stated twice is judged alike, and truth lies within its own bounds."""
    canonical = CATALOGUE[name]
    scene = canonical.scene(canonical.dimensions[0], canonical.representative)
    assert canonical.checks(scene, DT) == canonical.checks(scene, DT)
    truth = canonical.exact(scene)
    for check in canonical.checks(scene, DT):
        if check.bound is not None:
            assert check.truth == truth[check.metric] and check.bound > 0.0
