"""Materials of pairs by numbers of bodies: what an engine that mixes by the mean makes of them is what was asked."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.scene import Body, Disc, HalfSpace, Pair, Scene
from adapters.scene.means import means

#: Bodies lie on each other, so that all of them can meet.
NAMES = ("floor", "a", "b", "c")


def scene(materials, duration=1.0, places=(0.0, 0.4, 0.8)):
    """Discs on a floor; ``materials`` of pairs by their names, of all others the first one's."""
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed"),
        *(Body(name, Disc(0.5), 1.0, 0.125, (x, 0.5, 0.0)) for name, x in zip("abc", places, strict=True)),
    )
    pairs = tuple(Pair(a, b, restitution=e, friction=mu) for (a, b), (e, mu) in materials.items())
    return Scene("toy", 1, 2, bodies, pairs, (0.0, -9.81), duration, {})


def pairs_of(made):
    return [(i, j, material) for i, j, material in made.contact_pairs()]


@given(st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4), st.sampled_from(["restitution", "friction"]))
def test_numbers_of_bodies_give_every_pair_its_own(values, coefficient):
    """Whatever four bodies have, pairs of their means are representable, and what is found means the same."""
    made = scene({
        (NAMES[i], NAMES[j]): ((values[i] + values[j]) / 2.0,) * 2 for i, j in itertools.combinations(range(4), 2)
    })  # fmt: skip
    found = means(made, coefficient)
    assert found is not None and len(found) == 4
    for i, j, material in pairs_of(made):
        assert (found[i] + found[j]) / 2.0 == pytest.approx(getattr(material, coefficient), abs=1e-12)
    assert all(0.0 <= x <= 1.0 if coefficient == "restitution" else x >= 0.0 for x in found)


def six(floor_a=0.5, others=0.5):
    """One pair unlike the five others."""
    return {(a, b): (floor_a if (a, b) == ("floor", "a") else others,) * 2 for a, b in itertools.combinations(NAMES, 2)}


def test_equal_pairs_give_equal_bodies():
    assert means(scene(six()), "restitution") == [0.5] * 4 == means(scene(six()), "friction")


@pytest.mark.parametrize("coefficient", ["restitution", "friction"])
def test_no_body_values_for_one_deviating_pair(coefficient):
    assert means(scene(six(0.25)), coefficient) is None


@pytest.mark.parametrize("size", [1e-3, 1e-9])
def test_pair_missed_by_a_little_does_not_meet(size):
    assert means(scene(six(0.5 + size)), "friction") is None


def test_refusal_of_a_material_out_of_range():
    """Means of 1 and 0 and of 1.5 and 0 alike ask one body for twice the largest; friction has no largest."""
    e = {("floor", "a"): 0.75, ("floor", "b"): 0.0, ("a", "b"): 0.75}
    everything = {pair: (e.get(pair, 0.0), e.get(pair, 0.0)) for pair in itertools.combinations(("floor", "a", "b"), 2)}
    bodies = scene(everything | {("floor", "c"): (0.0, 0.0), ("a", "c"): (0.75, 0.75), ("b", "c"): (0.0, 0.0)})
    found = means(bodies, "friction")
    assert found == pytest.approx([0.0, 1.5, 0.0, 0.0], abs=1e-12)
    assert means(bodies, "restitution") is None


def test_any_value_for_pairs_that_cannot_meet():
    """Three discs a kilometre apart on a floor: only the floor meets each."""
    far = scene(six(0.25), duration=0.1, places=(0.0, 1e3, 2e3))
    found = means(far, "restitution")
    assert found is not None
    for k, value in ((1, 0.25), (2, 0.5), (3, 0.5)):
        assert (found[0] + found[k]) / 2.0 == pytest.approx(value, abs=1e-12)
