"""The Drake adapter, on small scenes with known answers."""

import math
from dataclasses import replace

import pytest
from driven import FLOOR, driven

from adapters.conformance import items
from adapters.drake import DrakeEngine
from adapters.drake.landing import landing_law
from adapters.drake.laws import DEVIATIONS, FALLING
from adapters.drake.shipped import ACCURACY, DISSIPATION, MODULUS, POINT_STIFFNESS, RELAXATION, STICTION
from adapters.drake.translation import frictions, pair_of
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.scene import Body, Box, HalfSpace, Pair, Scene, Sphere
from adapters.scene.lift import lift
from adapters.stepping import run
from validation.catalogue import CATALOGUE

pytestmark = pytest.mark.optional("drake")
ENGINE = DrakeEngine()
DT = 1.0 / 240.0
settings, drive = driven(ENGINE, "default")
#: Profiles with a step.
STEPPED = [profile for profile in ENGINE.profiles if profile != "cenic"]
BOX = Body("box", Box((0.5, 0.5, 0.25)), 3.0, (0.3125, 0.3125, 0.5), (0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0))


def resting(mu=0.5, **changes):
    return Scene("rest", 1, 3, (FLOOR, replace(BOX, **changes)), (Pair(friction=mu),), (0.0, 0.0, -9.81), 0.25)


@pytest.mark.parametrize("item", items(ENGINE), ids=str)
def test_conformance(item):
    item.hold()


def test_shipped_numbers_equal_to_the_engine_s_own():
    from pydrake.geometry import SceneGraphConfig
    from pydrake.multibody.plant import MultibodyPlantConfig
    from pydrake.systems.analysis import SimulatorConfig

    given, plant = SceneGraphConfig().default_proximity_properties, MultibodyPlantConfig()
    assert (given.point_stiffness, given.hydroelastic_modulus) == (POINT_STIFFNESS, MODULUS)
    assert (given.hunt_crossley_dissipation, given.relaxation_time) == (DISSIPATION, RELAXATION)
    assert SimulatorConfig().accuracy == ACCURACY
    assert plant.stiction_tolerance == STICTION and plant.contact_model == "hydroelastic_with_fallback"
    assert plant.discrete_contact_approximation == settings(resting())["approximation"] == "lagged"


@pytest.mark.parametrize("profile", STEPPED)
@pytest.mark.parametrize(
    ("name", "params"), [("impact", {"e": 0.0}), ("impact", {"e": 0.0, "v": 50.0}), ("bounce", {"e": 0.0})], ids=str
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_spring_rebound_by_the_law(name, params, dimension, profile):
    canonical = CATALOGUE[name]
    scene = canonical.scene(dimension, params)
    found = canonical.measure(scene, run(ENGINE, scene, DT, settings(scene, profile), canonical.sampling(scene)))
    seen = 0
    for metric in FALLING[name]:
        laws = [d for d in DEVIATIONS if d.covers("drake", "1.51.1", profile, name, metric)]
        told = [each for each in (d.law(scene, DT, canonical.measure) for d in laws) if each is not None]
        value = found[metric][0]
        if value is None:
            assert not told
            continue
        ((said, band),) = told
        assert abs(value - said) <= band, metric
        seen += 1
        if metric == "rebound_speed":
            assert abs(value * 1.01 - said) > band
            assert profile == "sap" or value == pytest.approx(1.0 / DISSIPATION, rel=1e-6)
    assert seen >= 3


@pytest.mark.parametrize("profile", STEPPED)
@pytest.mark.parametrize("params", [{}, {"depth": 0.01, "ratio": 100.0}], ids=str)
@pytest.mark.parametrize("dimension", [2, 3])
def test_separation_speed_of_overlapping_balls_by_the_law(params, dimension, profile):
    canonical = CATALOGUE["overlap"]
    scene = canonical.scene(dimension, params)
    found = canonical.measure(scene, run(ENGINE, scene, DT, settings(scene, profile), canonical.sampling(scene)))
    (law,) = [d.law for d in DEVIATIONS if d.covers("drake", "1.51.1", profile, "overlap", "thrown")]
    said, band = law(scene, DT, canonical.measure)
    assert abs(found["thrown"][0] - said) <= band < 1e-3 * said


def test_point_of_contact_in_an_overlap():
    """SAP's regularisation knows the arm of the point: at the surface it would be 1.2e-3 of the rebound off."""
    impact = CATALOGUE["impact"]
    scene = impact.scene(3, {"e": 0.0})
    value = impact.measure(scene, drive(scene, "sap"))["rebound_speed"][0]
    floor, ball = scene.bodies
    farther = replace(scene, bodies=(floor, replace(ball, inertia=tuple(0.98 * x for x in ball.inertia))))
    told, others = (landing_law("rebound_speed", "sap")(each, DT, impact.measure) for each in (scene, farther))
    assert abs(value - told[0]) < 1e-9 < 1e-4 < abs(value - others[0])


def test_no_law_for_a_rebounding_or_spinning_ball():
    impact = CATALOGUE["impact"]
    law = landing_law("rebound_speed", "default")
    scene = impact.scene(3, {"e": 0.0})
    floor, ball = scene.bodies
    assert law(scene, DT, impact.measure) is not None
    assert law(impact.scene(3, {"e": 0.5}), DT, impact.measure) is None
    spun = replace(ball, twist=(*ball.twist[:5], 1.0))
    assert law(replace(scene, bodies=(floor, spun)), DT, impact.measure) is None


@pytest.mark.parametrize("heading", [0.0, math.pi / 8.0, math.pi / 4.0])
def test_friction_of_tamsi_is_a_cone(heading):
    slid = resting(0.3, twist=(3.0 * math.cos(heading), 3.0 * math.sin(heading), 0.0, 0.0, 0.0, 0.0))
    speed = math.hypot(*drive(slid, "tamsi").twist[-1, 1, :2])
    # What the first step falls, without an overlap yet, the second one takes back with its friction.
    assert (3.0 - speed) / (0.3 * 9.81 * 0.25) == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize(("profile", "told"), [("sap", True), ("similar", True), ("tamsi", True), ("default", False)])
def test_receipt_of_too_much_friction(profile, told):
    """Half as much again: what is declared of the two that glide has an end upwards, though none is known downwards."""
    declared = ENGINE.declares(profile, needs(resting(0.5)), DT).get("friction")
    found = 0.75
    assert (declared is None or abs(found - declared.value) > declared.band) == told


def test_sliding_box_on_a_surface_and_tipping_on_a_point():
    slid = resting(0.3, twist=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    level = abs(drive(slid, "tamsi").twist[-20:, 1, 3:]).max()
    tipped = abs(drive(slid, "tamsi", boxes="point").twist[-20:, 1, 3:]).max()
    assert level < 1e-5 and tipped > 1e-2


@pytest.mark.parametrize(
    ("params", "changes"),
    [({}, {"dissipation": 0.0}), ({"angle": 60.0}, {"dissipation": 0.0}), ({"ratio": 20.0}, {}),
     ({"angle": 60.0, "ratio": 20.0}, {})],
    ids=str,
)  # fmt: skip
def test_sliding_edge_braked_by_the_slant_of_a_compliant_face(params, changes):
    """Pressure falls from 10 MPa half-way through a box to 0 at its face: where two are equal lies a slanted surface.

    Its part that approaches while the edge slides carries all, ``slant`` below the face's own normal. Newton's law:
    down = m g sin a/(m + M cos a cos(a - slant)/cos slant). Where the edge is fast and contacts dissipate it parts.
    """
    shove = CATALOGUE["shove"]
    scene = shove.scene(2, params)
    p, a = scene.params, math.radians(scene.params["angle"])
    steep = [1.0 / min(body.shape.half_extents) for body in scene.bodies[2:]]
    slant = math.atan2(steep[0] * math.sin(a), steep[1] + steep[0] * math.cos(a))
    held = p["ratio"] * math.cos(a) * math.cos(a - slant) / math.cos(slant)
    told, true = p["g"] * math.sin(a) / (1.0 + held), shove.exact(scene)["down"]
    found = shove.measure(scene, run(ENGINE, scene, DT, settings(scene, **changes), shove.sampling(scene)))["down"][0]
    assert found == pytest.approx(told, rel=0.02) and abs(true / told - 1.0) > 0.25


def test_loads_and_weight_in_every_step():
    pushed = replace(resting(0.0, force=(3.0, 0.0, 0.0)), pairs=(Pair(),))
    found = drive(pushed, "tamsi")
    assert found.twist[-1, 1, 0] == pytest.approx(0.25, rel=1e-6)
    assert found.contacts.impulse_between(0, 1)[-20:, 2].mean() / DT == pytest.approx(3.0 * 9.81, rel=1e-5)


def test_friction_of_a_pair_is_a_harmonic_mean():
    assert pair_of(0.1, 0.3) == pytest.approx(0.15) and pair_of(0.0, 0.0) == 0.0 == pair_of(0.0, 1.0)
    three = [Body(n, Sphere(0.5), 1.0, (0.1,) * 3, (2.0 * k, 0, 0, 1.0, 0, 0, 0), (1.0,)) for k, n in enumerate("abc")]
    three = [replace(body, twist=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)) for body in three]
    smooth = (Pair("a", "b", 0.0, 0.5), Pair("b", "c", 0.0, 0.0), Pair("a", "c", 0.0, 0.0))
    scene = Scene("three", 1, 3, tuple(three), smooth, (0.0, 0.0, 0.0), 9.0)
    assert frictions(scene) == [0.5, 0.5, 0.0]
    # Of three numbers each pair has another: 2 a b/(a + b) of 0.6, 0.3 and 0.5.
    table = (Pair("a", "b", 0.0, 0.4), Pair("a", "c", 0.0, 0.6 / 1.1), Pair("b", "c", 0.0, 0.375))
    assert frictions(replace(scene, pairs=table)) == pytest.approx([0.6, 0.3, 0.5], rel=1e-14)
    assert ENGINE.refuses(replace(scene, pairs=table), "default") is None
    odd = replace(scene, pairs=(Pair("a", "b", 0.0, 0.9), Pair("b", "c", 0.0, 0.9), Pair("a", "c", 0.0, 0.1)))
    assert "harmonic" in ENGINE.refuses(odd, "default")


def test_unsupported_scenes_refused_in_one_line():
    bouncing = replace(resting(), pairs=(Pair(restitution=0.5),))
    assert ENGINE.refuses(bouncing, "default").startswith("pairs: ")
    moved = replace(resting(), bodies=(FLOOR, replace(BOX, motion="prescribed")))
    assert ENGINE.refuses(moved, "default").startswith("box.motion: ")
    with pytest.raises(EngineError, match=r"^pairs: "):
        ENGINE.build(bouncing, DT, settings(resting()))


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"approximation": "lemke"}, "approximation"), ({"modulus": 0.0}, "modulus"), ({"boxes": "mesh"}, "boxes"),
     ({"stiction_tolerance": math.nan}, "stiction_tolerance"), ({"iterations": 5}, "iterations")],
)  # fmt: skip
def test_refusal_of_a_bad_setting_by_name(changes, field):
    with pytest.raises(EngineError, match=rf"^{field}[^\n]*\Z"):
        ENGINE.build(resting(), DT, settings(resting(), **changes))


def test_facets_of_a_surface_not_mirror_symmetric():
    """Of a box that lies flat in the lift: the four large ones mirror each other, slivers between them do not."""
    floor, box = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"), Body("box", Box((0.5, 0.25)), 1.0, 0.1)
    scene = Scene(
        "rest", 1, 2, (floor, replace(box, pose=(0.0, 0.2499, 0.0))), (Pair(friction=0.5),), (0.0, -9.81), 1.0
    )
    simulation = ENGINE.build(lift(scene), DT, settings(scene))
    simulation.advance(1)
    found = simulation.plant.get_contact_results_output_port().Eval(simulation.context)
    surface = found.hydroelastic_contact_info(0).contact_surface()
    facets = [(*surface.centroid(f), surface.area(f)) for f in range(surface.num_faces())]

    def mirrored(within, least):
        large = [facet for facet in facets if facet[3] >= least]
        return all(
            any(abs(x - u) + abs(y + v) < within and a == pytest.approx(b, rel=1e-2) for u, v, _, b in large)
            for x, y, _, a in large
        )

    assert sum(facet[3] > 0.2 for facet in facets) == 4
    assert mirrored(1e-3, 0.2) and not mirrored(1e-6, 0.2) and not mirrored(1e-3, 0.0)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-6, 1e-7])
def test_error_of_a_fall_by_the_root_of_the_accuracy(accuracy):
    # A step of h and two of h/2 differ by g h^2/4, which is the accuracy; two of h/2 fall g t h/4 too far in t.
    scene = replace(resting(pose=(0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0)), duration=0.5)
    found = run(ENGINE, scene, DT, {**settings(scene, "cenic"), "accuracy": accuracy})
    late = 9.0 - 9.81 * found.t[-1] ** 2 / 2.0 - found.pose[-1, 1, 2]
    most = found.t[-1] * math.sqrt(9.81 * accuracy) / 2.0
    assert 0.7 * min(most, 9.81 * found.t[-1] * DT / 4.0) <= late <= most


def test_error_of_a_blow_at_any_accuracy():
    # Closed form of Hunt and Crossley: d w + ln(1 - d w) is the same before and after the blow.
    scene = CATALOGUE["impact"].scene(3, {"e": 0.0, "v": 0.1})

    def rebound(accuracy, dt):
        found = run(ENGINE, scene, dt, {**settings(scene, "cenic"), "accuracy": accuracy})
        return DISSIPATION * found.twist[-1, 1, 2]

    def kept(w):
        return w + math.log1p(-w)

    right = 0.9849  # the blow ends with a speed of 19.70 mm/s; dissipation allows 1 (20 mm/s), which CENIC nearly has
    assert kept(right) == pytest.approx(kept(-DISSIPATION * 0.1), rel=1e-3)
    assert abs(rebound(1e-4, DT) - right) > 0.014 and abs(rebound(1e-8, DT) - right) > 0.014
    assert abs(rebound(1e-8, 1.0 / 16000.0) - right) < 0.005


def test_refusal_of_an_accuracy_with_a_step():
    scene = resting()
    assert ENGINE.checked({**settings(scene), "approximation": "cenic"})["accuracy"] == ACCURACY
    with pytest.raises(EngineError, match=r"^accuracy: of approximation=cenic only; lagged has a step$"):
        ENGINE.build(scene, DT, {**settings(scene), "accuracy": 1e-3})
