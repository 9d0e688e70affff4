"""Laws of both Box2D for a leaning rod that lands on its end: what they say, and that they are not the textbook's."""

import pytest

from adapters.box2d.laws import DEVIATIONS as OLDER
from adapters.box2d.rod_on_its_end import halfway_law
from adapters.box2d3.laws import DEVIATIONS as NEWER
from validation.catalogue import CATALOGUE

DT = 1.0 / 240.0
KANE = CATALOGUE["kane"]


def scene(**params):
    return KANE.make(2, {p.name: p.default for p in KANE.parameters} | params)


@pytest.mark.parametrize("deviation", [d for d in (*OLDER, *NEWER) if d.scene == "kane"])
def test_a_law_is_another_than_the_textbook_s_by_more_than_its_band(deviation):
    found = deviation.law(scene(), DT, KANE.measure)
    assert found is not None
    value, band = found
    assert band < abs(value - KANE.exact(scene())[deviation.metric])


def test_nothing_is_said_of_a_blow_within_a_skin_or_just_at_a_step():
    said = halfway_law("rise", lambda scene, dt: (64.0, 0.0), 1.0)
    assert said(scene(), DT, KANE.measure) is not None
    assert said(scene(delay=24.0 * DT), DT, KANE.measure) is None
    assert halfway_law("rise", lambda scene, dt: (64.0, 0.01), 1.0)(scene(), DT, KANE.measure) is None


def test_below_the_threshold_nothing_rebounds():
    (slow, band) = halfway_law("rise", lambda scene, dt: (1.0, 0.0), 1.0)(scene(), DT, KANE.measure)
    (plastic, _) = halfway_law("rise", lambda scene, dt: (64.0, 0.0), 1.0)(scene(e=0.0), DT, KANE.measure)
    assert slow == pytest.approx(plastic, abs=band)
