"""What Box2D makes of seams, far places and corners: the laws of `adapters.single_motions` against the engine."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("Box2D", reason="Box2D is set apart: pip install 'contact-crosscheck[box2d]'")

from adapters.box2d import Box2DEngine
from adapters.box2d.laws import DEVIATIONS
from adapters.needs import needs
from adapters.scene import Pair
from adapters.stepping import run
from validation.catalogue import CATALOGUE

ENGINE = Box2DEngine()
DT = 1.0 / 240.0
CORNER, FAR, SEAM = CATALOGUE["edge_drop"], CATALOGUE["far_origin"], CATALOGUE["seam"]
METRICS = ("rise", "spin", "impulse")


def settings(scene, profile, **changes):
    return {s.name: s.value for s in ENGINE.settings(profile, needs(scene), DT)} | changes


def drive(canonical, scene, profile, dt=DT, **changes):
    return run(ENGINE, scene, dt, settings(scene, profile, **changes), canonical.sampling(scene))


def law_of(scene, metric, profile):
    return next(law for law in DEVIATIONS if (law.scene, law.metric, law.profiles) == (scene, metric, (profile,)))


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize("variation", [*CORNER.quick[1:], *CORNER.full], ids=str)
def test_a_box_on_its_corner_is_where_the_law_says_and_a_thousandth_more_is_not(variation, profile):
    scene = CORNER.scene(2, variation.params)
    measured = CORNER.measure(scene, drive(CORNER, scene, profile))
    spoilt = CORNER.measure(scene, drive(CORNER, replace(scene, pairs=(Pair(restitution=0.999 * scene.params["e"]),)),
                                         profile))  # fmt: skip
    for metric in METRICS:
        value, band = law_of("edge_drop", metric, profile).law(scene, DT, CORNER.measure)
        assert abs(measured[metric][0] - value) <= band < 1e-4, metric
        if profile == "tuned":  # as shipped nothing rebounds at this speed, whatever the coefficient
            assert abs(spoilt[metric][0] - value) > band, metric


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_a_box_stands_still_where_a_step_is_less_than_half_a_spacing_of_singles(profile):
    """And moves where it is more: the speed alone decides, at the same place."""
    law = law_of("far_origin", "stopping_distance", profile).law
    spacing = float(np.spacing(np.float32(2.0**20)))
    for share, still in ((0.45, True), (0.55, False)):
        scene = FAR.scene(2, {"v": share * spacing / DT})
        moved = FAR.measure(scene, drive(FAR, scene, profile))["stopping_distance"][0]
        said = law(scene, DT, FAR.measure)
        assert (moved == 0.0) == still and (said is not None) == still
        assert not still or said == (0.0, 0.0)


@pytest.mark.parametrize(("skin", "stopped"), [(0.01, True), (0.0, False)])
def test_a_skin_makes_the_side_of_the_next_plate_a_contact_before_the_seam(skin, stopped):
    scene = SEAM.scene(2)
    names = [body.name for body in scene.bodies]
    plate, box = names.index("plate2"), names.index("box")
    half, seam = scene.bodies[box].shape.half_extents[0], 0.5 * scene.params["plate"]
    simulation = ENGINE.build(scene, DT, settings(scene, "default", skin=skin))
    for _ in range(60):
        simulation.advance(1)
        contacts = simulation.contacts()
        found = np.flatnonzero(contacts.a == plate)
        if len(found):
            break
    assert len(found)
    before = simulation.pose()[box, 0] + half < seam
    sideways = abs(contacts.normal[found[0], 0]) > 0.99
    assert (before, sideways) == (stopped, stopped)
    assert (simulation.twist()[box, 0] < 1.0) == stopped
