"""How far an engine can be driven: brackets close on where it gives up, and their ends are cells that prove it."""

import math

import pytest

from validation.canonical import Frontier
from validation.cells import LONGEST_DT, Observation, Outcome, Slot
from validation.posed import resolve
from validation.questions.frontier import FULL_RATIO, QUICK_RATIO, Bracket, axes, brackets, fate_of, search, slot_at

BACK = {"rebound_ratio": (0.5, ""), "beyond": (0.0, "")}
THROUGH = {"rebound_ratio": (-1.0, ""), "beyond": (9.0, "")}
STOOD = {"drift": (1e-5, ""), "penetration": (1e-5, ""), "kinetic_energy": (1e-9, "")}


def axis(scene, name):
    (found,) = [frontier for own, frontier in axes([scene]) if frontier.name == name]
    return found


def bracket(scene, name):
    own = axis(scene, name)
    dimension = resolve(scene).dimensions[0]
    slot = Slot(scene, resolve(scene).minimal(own.params), dimension, "toy", "tuned", 1 / 240)
    return Bracket(slot, own, _hard=own.hard)


def value(slot, own):
    if own.axis in ("dt", "iterations"):
        return getattr(slot, own.axis)
    return resolve(slot.scene).complete(dict(slot.params))[own.axis]


def asked(one, lasts, ratio, good, bad):
    """Search with an engine of which ``lasts(value)`` says whether it survives; the values that it was asked."""
    seen = []

    def look(slots):
        seen.extend(value(slot, one.frontier) for slot in slots)
        return {
            s: Observation(s, "c", 1, "1", Outcome.OK, metrics=good if lasts(value(s, one.frontier)) else bad)
            for s in slots
        }

    *_, (still, _) = search([one], ratio, look=look)
    assert still == 0
    return seen


@pytest.mark.parametrize("ratio", [QUICK_RATIO, FULL_RATIO])
@pytest.mark.parametrize("limit", [1.5, 37.0, 800.0])
def test_bracket_around_the_failure_of_an_engine(limit, ratio):
    one = bracket("thin_wall", "impact speed")
    seen = asked(one, lambda v: v <= limit, ratio, BACK, THROUGH)
    assert one.survives.value <= limit < one.fails.value <= one.survives.value * ratio
    assert (one.survives.fate, one.fails.fate) == ("", "tunnelled")
    assert one.cells == len(seen) <= 2 + math.ceil(math.log2(math.log(1e3) / math.log(ratio)))
    for end in (one.survives, one.fails):
        assert value(end.slot, one.frontier) == end.value


def test_whole_numbers_end_at_neighbours_from_either_side():
    tall = bracket("stack", "stack height")
    asked(tall, lambda n: n <= 7, 9.0, STOOD, STOOD | {"drift": (3.0, "")})
    assert (tall.survives.value, tall.fails.value, tall.fails.fate) == (7, 8, "toppled")
    few = bracket("stack", "iterations")
    asked(few, lambda n: n >= 23, 9.0, STOOD, STOOD | {"penetration": (0.3, "")})
    assert (few.survives.value, few.fails.value, few.fails.fate) == (23, 22, "sank")
    assert few.survives.slot.iterations == 23 and dict(few.survives.slot.params) == {"n": 10.0}


def test_frontier_without_a_failure_or_without_a_pass():
    safe, lost = bracket("thin_wall", "impact speed"), bracket("thin_wall", "impact speed")
    assert asked(safe, lambda v: True, QUICK_RATIO, BACK, THROUGH) == [1.0, 1e3]
    assert safe.text == "1000 m/s works, the hardest value that was tried"
    assert asked(lost, lambda v: False, QUICK_RATIO, BACK, THROUGH) == [1.0]
    assert lost.text == "already 1 m/s tunnelled"


def test_reason_of_an_unsupported_engine():
    one = bracket("thin_wall", "impact speed")

    def look(slots):
        return {slot: Observation(slot, "", 1, "1", Outcome.UNSUPPORTED, "it is planar") for slot in slots}

    *_, (still, _) = search([one], QUICK_RATIO, look=look)
    assert still == 0 and one.text == "it is planar" and one.cells == 1


@pytest.mark.parametrize(("outcome", "word"), [(Outcome.DIVERGED, "NaN"), (Outcome.TIMED_OUT, "time")])
def test_a_cell_without_an_answer_did_not_survive(outcome, word):
    one = bracket("thin_wall", "impact speed")
    slot = slot_at(one, 10.0)
    assert word in fate_of(one.frontier, Observation(slot, "c", 1, "1", outcome, "why"))


APART = {"thrown": (0.9, ""), "centre_moved": (0.04, ""), "grown": (0.02, ""), "left": (0.5, "")}


@pytest.mark.parametrize(
    ("scene", "name", "good", "changes", "word"),
    [
        ("stack", "step", STOOD, {"drift": (0.6, "")}, "toppled"),
        ("stack", "step", STOOD, {"penetration": (0.2, "")}, "sank"),
        ("stack", "step", STOOD, {"kinetic_energy": (60.0, "")}, "exploded"),
        ("stack", "step", STOOD, {"kinetic_energy": (None, "gone")}, "NaN"),
        ("heavy_on_light", "mass ratio", STOOD, {"penetration": (0.2, "")}, "sank"),
        ("thin_wall", "impact speed", BACK, {"beyond": (0.2, "")}, "tunnelled"),
        ("thin_wall", "impact speed", BACK, {"rebound_ratio": (0.0, "")}, "stuck"),
        ("tumble", "spin", {"momentum_drift": (0.4, ""), "energy_drift": (0.4, "")}, {"energy_drift": (0.6, "")},
         "changed its spin"),
        ("tumble", "spin", {"momentum_drift": (0.4, ""), "energy_drift": (0.4, "")}, {"momentum_drift": (2.0, "")},
         "exploded"),
        ("overlap", "overlap", APART, {"thrown": (1.1, "")}, "flew apart"),
        ("overlap", "overlap", APART, {"centre_moved": (0.06, "")}, "drove off"),
        ("overlap", "overlap", APART, {"grown": (0.03, "")}, "sank in"),
        ("overlap", "overlap", APART, {"thrown": (None, "gone")}, "no answer"),
    ],
)  # fmt: skip
def test_words_for_every_way_to_end(scene, name, good, changes, word):
    own = axis(scene, name)
    made = resolve(scene).scene(resolve(scene).dimensions[0], dict(own.params))
    assert own.fate(made, good) == ""
    assert own.fate(made, good | changes) == word


@pytest.mark.parametrize(("scene", "own"), axes(), ids=lambda x: x if isinstance(x, str) else x.name)
def test_ends_of_every_declared_axis(scene, own):
    assert isinstance(own, Frontier) and own.survives and own.easy != own.hard
    for number in (own.easy, own.hard, own.hardest):
        slot = slot_at(Bracket(Slot(scene, (), resolve(scene).dimensions[0], "toy", "tuned", 1 / 240), own), number)
        assert value(slot, own) == number
        resolve(scene).scene(slot.dimension, dict(slot.params))


def test_steps_along_every_axis():
    ends = [end for _, own in axes() if own.axis == "dt" for end in (own.easy, own.hard, own.hardest)]
    assert ends and max(ends) <= LONGEST_DT


def test_bracket_of_a_real_engine():
    pytest.importorskip("pymunk")
    found = brackets(["thin_wall"], ["chipmunk"], ["tuned"], [2], quick=True)
    *_, _ = search(found, QUICK_RATIO)
    (one,) = found
    # Its ball of 0.1 m and plate of 0.02 m: it cannot miss what moves less than 0.12 m a step, nor find what moves 1 m.
    assert 0.12 * 240 * 0.5 <= one.survives.value < one.fails.value < 240.0
    assert one.fails.fate in ("tunnelled", "stuck")


def test_refusal_of_a_scene_that_cannot_be_driven():
    from click.testing import CliRunner

    from reports.command import main

    result = CliRunner().invoke(main, ["frontier", "impact"])
    assert (
        result.exit_code == 2
        and "impact has no breaking point to search" in result.stderr
        and "thin_wall" in result.stderr
    )


def test_dimensions_of_a_quick_and_a_named_search():
    pytest.importorskip("pymunk")
    name, frontier = next((name, f) for name, f in axes() if resolve(name).dimensions == (2, 3))

    def asked(dimensions, quick):
        found = brackets([name], ["reference"], ["reference"], dimensions, quick)
        assert {b.base.profile for b in found} <= {"reference"}
        return sorted({(b.base.dimension, b._hard) for b in found if b.frontier.name == frontier.name})

    assert asked((), True) == [(2, frontier.hard)] and asked((3,), True) == [(3, frontier.hard)]
    assert asked((2, 3), True) == [(2, frontier.hard), (3, frontier.hard)]
    assert asked((), False) == [(2, frontier.hardest), (3, frontier.hardest)]
