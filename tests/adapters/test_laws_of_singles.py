"""Laws that engines share, without an engine: where nothing is rounded they are the scenes' own truths."""

import math
from dataclasses import replace

import pytest

from adapters.law import Deviation
from adapters.law.single_motions import corner_law, kept_law, standstill_law
from adapters.law.single_precision import ROUNDINGS, UNIT, Method, Threshold, plane_law, rounded_law, without_a_place
from adapters.scene import Box, Pair
from validation import bounds
from validation.catalogue import CATALOGUE
from validation.findings import Known
from validation.judging.verdicts import judge

DT = 1.0 / 240.0
CORNER, FAR, SEAM = CATALOGUE["edge_drop"], CATALOGUE["far_origin"], CATALOGUE["seam"]
METRICS = ("rise", "spin", "impulse")
#: Scenes of blows in free space, each of them told by the law to round-off.
BLOWS = (
    "impact",
    "head_on",
    "oblique",
    "cradle",
    "stacked_balls",
    "galperin",
    "pair_matrix",
    "thin_wall",
    "off_centre",
)


def test_corner_law_equal_to_the_exact_truth_without_rounding():
    for variation in CORNER.full:
        scene = CORNER.scene(2, variation.params)
        for metric in METRICS:
            value, _ = corner_law(metric, lambda scene, dt: (1.0, 0.0), 0.0)(scene, DT, CORNER.measure)
            assert value == pytest.approx(CORNER.exact(scene)[metric], rel=1e-12)


def test_corner_law_silent_outside_its_case():
    def said(scene, units=1.0, skin=0.0, dt=DT):
        return corner_law("rise", lambda scene, dt: (units, skin), 1.0)(scene, dt, CORNER.measure)

    scene = CORNER.scene(2, {"e": 0.8, "tilt": 30.0, "v": 2.0})
    floor, box = scene.bodies
    assert said(scene) is not None
    assert said(scene, skin=0.01) is None
    assert said(CORNER.scene(2, {"e": 0.8, "tilt": 30.0}), skin=0.01) is not None  # at 1 m/s nothing rebounds
    assert said(scene, dt=scene.duration) is None
    for other in (
        replace(scene, gravity=(0.0, -1.0)),
        replace(scene, pairs=(Pair(restitution=0.8, friction=0.1),)),
        replace(scene, bodies=(floor, replace(box, twist=(0.0, -2.0, 1.0)))),
        replace(scene, bodies=(floor, replace(box, twist=(0.1, -2.0, 0.0)))),
        replace(scene, bodies=(floor, replace(box, twist=(0.0, 2.0, 0.0)))),
        replace(scene, bodies=(floor, replace(box, pose=(*box.pose[:2], 0.0)))),
        replace(scene, bodies=(floor, replace(box, force=(0.0, 1.0)))),
        CATALOGUE["impact"].scene(2),
        CORNER.scene(3),
    ):
        assert said(other) is None, other


def test_position_law_near_the_origin():
    law = standstill_law("stopping_distance", lambda scene, dt: (1.0, 0.0))
    far = FAR.scene(2)
    plate, box = far.bodies
    assert law(far, DT, FAR.measure) == (0.0, 0.0)
    for other in (
        FAR.scene(2, {"far": 0.0}),
        FAR.scene(2, {"far": 1024.0}),
        replace(far, gravity=(1.0, -9.81)),
        replace(far, bodies=(plate, replace(box, force=(1.0, 0.0)))),
        replace(far, bodies=(plate, replace(box, twist=(3.0, 1.0, 0.0)))),
        SEAM.scene(2),
    ):
        assert law(other, DT, FAR.measure) is None
    deep = FAR.scene(3)
    assert law(deep, DT, FAR.measure) == (0.0, 0.0)
    assert law(replace(deep, gravity=(0.0, 0.1, -9.81)), DT, FAR.measure) is None


def told(metric, method, scene, dt=DT):
    return rounded_law(metric, method)(scene, dt, CATALOGUE[scene.name].measure)


@pytest.mark.parametrize("name", BLOWS)
def test_event_by_event_blows_end_in_the_exact_truth(name):
    """In doubles, with the restitution that is asked for: as near as the scene's check asks of anybody."""
    canonical, exact, said = CATALOGUE[name], Method(lambda e, speed: e, 200, 2.0**-53), 0
    for dimension in canonical.dimensions:
        for variation in canonical.variations("standard"):
            scene = canonical.scene(dimension, variation.params)
            for check in canonical.checks(scene, DT):
                found = told(check.metric, exact, scene) if check.bound is not None else None
                if found is not None:
                    said += 1
                    assert abs(found[0] - check.truth) <= check.bound, (check.metric, variation.params)
                    assert 0.0 < found[1] < 1e-9, "a band of doubles"
    assert said >= 4


def test_law_band_in_proportion_to_the_rounding_unit():
    scene = CATALOGUE["head_on"].scene(3)
    bands = [told("impulse", Method(lambda e, speed: e, 0, unit), scene)[1] for unit in (UNIT, 2.0 * UNIT)]
    assert bands[1] == pytest.approx(2.0 * bands[0], rel=1e-3) and 1e-6 < bands[0] < 1e-3


def test_restitution_at_the_threshold_speed():
    scene = CATALOGUE["impact"].scene(2, {"e": 0.5, "v": 2.0})
    for limit, at, rebound in ((1.0, False, 0.5), (3.0, False, 0.0), (2.0, False, 0.0), (2.0, True, 0.5)):
        value, _ = told("rebound_ratio", Method(Threshold(limit, at)), scene)
        assert value == pytest.approx(rebound, abs=1e-12)
    assert Threshold(1.0)(0.7, 1.0) == 0.0 and Threshold(1.0)(0.7, 1.1) == 0.7


def test_law_silent_under_loads_and_quick_successive_blows():
    exact = Method(lambda e, speed: e, 200)
    scene = CATALOGUE["impact"].scene(2)
    assert told("rebound_ratio", exact, scene) is not None
    assert told("rebound_ratio", exact, replace(scene, gravity=(0.0, -1.0))) is None
    floor, ball = scene.bodies
    assert told("rebound_ratio", exact, replace(scene, bodies=(floor, replace(ball, force=(0.0, 1.0))))) is None
    row = CATALOGUE["cradle"].scene(2)
    metric = next(check.metric for check in CATALOGUE["cradle"].checks(row, DT) if check.bound is not None)
    assert told(metric, exact, row) is not None and told(metric, exact, row, 0.3 * row.params["apart"]) is None


def test_mass_beyond_single_precision_named():
    scene = CATALOGUE["impact"].scene(2)
    floor, ball = scene.bodies
    assert without_a_place(scene) is None
    for name in ("mass", "inertia"):
        for value in (1e-31, 1e31):
            said = without_a_place(replace(scene, bodies=(floor, replace(ball, **{name: value}))))
            assert said == f"{ball.name}.{name}: {value:g} cannot be represented in single precision"
    assert math.isclose(UNIT, 2.0**-24)


def test_plane_kept_to_a_thousand_roundings():
    """Of every planar scene the same multiple of the round-off that its check grants doubles."""
    for name, canonical in CATALOGUE.items():
        if 2 not in canonical.dimensions:
            continue
        scene = replace(canonical.scene(2), gravity=(0.0, 0.0))
        bodies = tuple(replace(body, force=(0.0, 0.0)) for body in scene.bodies)  # a step of either is granted apart
        scene = replace(scene, bodies=bodies)
        value, band = plane_law(scene, DT, canonical.measure)
        assert value == 0.0
        assert band == pytest.approx(5000.0 * 2.0**-24 * bounds.planar(scene, DT).bound / 1e-9, rel=1e-12), name
    flat = CATALOGUE["flat_box"].scene(2)
    assert plane_law(flat, DT, None) == plane_law(replace(flat, gravity=(0.0, -9.81)), 2.0 * DT, None)
    assert plane_law(CATALOGUE["impact"].scene(3), DT, None) is None


@pytest.mark.parametrize(("share", "standing"), [(0.99, "explained"), (1.01, "drifted"), (100.0, "drifted")])
def test_unexplained_departure_from_the_plane(share, standing):
    scene = CATALOGUE["flat_box"].scene(2)
    law = Deviation("toy", ("default",), "flat_box", "out_of_plane", plane_law, "numbers are singles", "source")
    value, band = law.says(scene, DT, CATALOGUE["flat_box"].measure)
    told = judge(share * band, bounds.planar(scene, DT), [(law, value, band)], Known(None, True))
    assert (told.physics.value, told.standing.value) == ("fail", standing)


def test_law_of_conserved_quantities_silent_under_other_losses():
    """A load of any kind, on one body alone, is enough; and so are friction, loss, a box or a ball that is held."""
    law, scene = kept_law("momentum_defect"), CATALOGUE["rack"].scene(2)
    value, band = law(scene, DT, CATALOGUE["rack"].measure)
    # The roundings of one blow for each pair that can touch: six around a ball, half a pair each.
    assert value == 0.0 and band == pytest.approx(ROUNDINGS * 2.0**-24 * 3.0 * len(scene.bodies), rel=1e-12)
    last, pair = scene.bodies[-1], scene.pairs[0]
    pushed = {"force": (1.0, 0.0), "torque": (1.0,), "motion": "fixed", "shape": Box((0.1, 0.1))}
    changes = [{"bodies": (*scene.bodies[:-1], replace(last, **{name: value}))} for name, value in pushed.items()]
    changes += [{"gravity": (0.0, -9.81)}, {"gravity": (0.1, 0.0)}]
    changes += [
        {"pairs": (replace(pair, **own), *scene.pairs[1:])} for own in ({"restitution": 0.99}, {"friction": 0.1})
    ]
    for change in changes:
        assert law(replace(scene, **change), DT, CATALOGUE["rack"].measure) is None, change
