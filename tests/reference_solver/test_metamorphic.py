"""Metamorphic relations on every scene up to its horizon; hypothesis picks the numbers, the same in every run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_solver import Settings
from reference_solver.certificate.relations import Change, permuted, quaternion, turned
from tests.verification import metamorphic
from tests.verification.metamorphic import ANY_PROFILE, EXACT, REFERENCE_ONLY, REVERSIBLE, Trial, change_of
from tests.verification.relations import canonical_order, defect, run
from tests.verification.scenes import DT, GROWTH, SCENES, Numbers
from tests.verification.space import SPACES

#: Fixed seed, so that a failure is everyone's; each example steps six scenes.
CHOSEN = settings(derandomize=True, max_examples=15)


@st.composite
def trials(draw, dimension):
    number = st.floats(0.0, 1.0).map(lambda x: x if x > 1e-9 else 0.0)  # in other units it must not be subnormal
    across = draw(st.floats(-1.0, 1.0)) if dimension == 3 else 0.0
    numbers = Numbers(draw(number), draw(number), draw(st.floats(0.5, 4.0)), draw(st.floats(0.05, 0.5)), across)
    vector = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
    powers = draw(st.tuples(*[st.integers(-12, 12)] * 3))
    return Trial(numbers, vector, powers, draw(st.integers(0, 999)))


@pytest.mark.few(8)
@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize(
    ("relation", "profile"),
    [(r, p) for r in ANY_PROFILE for p in ("classical", "reference")] + [(r, "reference") for r in REFERENCE_ONLY],
)
def test_relation_holds_on_every_scene(relation, profile, space):
    @CHOSEN
    @given(trials(space.dimension))
    def holds(trial):
        for scene in REVERSIBLE if relation == "time reversal" else SCENES:
            found = metamorphic.measure(relation, scene, space, profile, trial)
            assert found <= (0.0 if relation in EXACT else 1.0), (scene, trial)

    holds()


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("profile", ["classical", "reference"])
def test_bits_of_equal_worlds_in_canonical_order(profile, space):
    @CHOSEN
    @given(trials(space.dimension))
    def holds(trial):
        for scene in SCENES:
            assert metamorphic.renumbered_bits(scene, space, profile, trial) == 0.0, (scene, trial)

    holds()


@pytest.mark.few(6)
@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("scene", SCENES)
def test_growth_of_disturbances_up_to_the_horizon(scene, space):
    @settings(CHOSEN, max_examples=4)
    @given(trials(space.dimension))
    def holds(trial):
        assert metamorphic.growth(scene, space, "reference", trial) <= GROWTH, trial

    holds()


def test_relations_see_what_breaks_them():
    """Each bound is sharp enough to notice a thousandth of a thousandth of a wrong gravity."""
    space, numbers = SPACES[0], Numbers()
    for relation in ("mirror", "quarter turn", "Galilean boost", "far origin"):
        change = change_of(relation, space, Trial(numbers))
        model = SCENES["bounce"].build(space, numbers)
        old = run(model, Settings.reference(DT), 60)
        changed = change.model(model)
        wrong = type(changed)(
            2, changed.bodies, tuple(1.000001 * g for g in changed.gravity), changed.restitution, changed.friction
        )
        new = run(wrong, Settings.reference(DT), 60)
        assert np.abs(new.twist - change.twist(old.twist)).max() > 100.0 * metamorphic.bound(change, 60)


def test_fault_of_a_boost_without_the_floor():
    space = SPACES[0]
    model = SCENES["incline"].build(space, Numbers())
    change = Change(2, boost=(3.0, 0.0))
    assert defect(change, model, Settings.reference(DT), 60) <= metamorphic.bound(change, 60)
    assert change.model(model).bodies[0].motion == "prescribed"


@pytest.mark.parametrize("index", range(4))
def test_quarter_turns_in_space_by_their_matrix(index):
    axes, signs = metamorphic.TURNS[3][index]
    change = Change(3, axes=axes, signs=signs)
    q = quaternion(change.matrix)
    for vector in np.eye(3):
        there = turned(q, np.array([0.0, *vector]))
        back = turned(there, np.array([q[0], *-q[1:]]))
        assert back[1:] == pytest.approx(change.polar(vector), abs=1e-15)


def test_canonical_order_of_a_renumbered_world():
    model = SCENES["stack"].build(SPACES[0], Numbers())
    sorted_bodies = permuted(model, canonical_order(model)).bodies
    for order in ([3, 2, 1, 0], [1, 3, 0, 2]):
        other = permuted(model, order)
        assert permuted(other, canonical_order(other)).bodies == sorted_bodies
