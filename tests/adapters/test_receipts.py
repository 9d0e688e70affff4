"""Receipts: what is measured, at which settings, against what, and what a refusal means."""

import math
from dataclasses import replace

import pytest

from adapters.conformance.faults import FaultyToy
from adapters.conformance.planted_faults import Planted
from adapters.conformance.toy import ToyEngine
from adapters.engine import Declared, EngineError, Scheme, Setting
from adapters.needs import Needs
from adapters.receipts import QUANTITIES, RECORDED, Receipt, _receipt, _starved, contradictions, receipts
from adapters.receipts.probes import HALF_EXTENTS, LANDING_SPEED, PROBES, REBOUND_PHASES, REBOUND_SPEED, Case
from adapters.registry import find

DT = 1 / 60
IMPACT = Needs(2, True, 0.5, 0.8, "impact", True, 1.0, 6.0, 1.0, 9.81, 9.81)
REST = Needs(2, True, 0.5, 0.0, "rest", False, 1.0, 6.0, 1.0, 9.81, 9.81)
SMOOTH = Needs(2, False, 0.0, 0.8, "impact", False, 1.0, 6.0, 1.0, 9.81, 9.81)


SEMI = ToyEngine.facts.scheme


def by_quantity(slips):
    return {slip.quantity: slip for slip in slips}


def declaring(fault="", **declared):
    class Declaring(FaultyToy if fault else ToyEngine):
        def declares(self, profile, needs, dt):
            return declared

    return Declaring(fault, 1.0) if fault else Declaring()


def dragged(**declared):
    """An engine that takes 4 % a second of all speeds, and declares that or not."""

    class Dragged(ToyEngine):
        def declares(self, profile, needs, dt):
            return declared

        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            step = simulation._step

            def slower(dt):
                step(dt)
                simulation.poses[:, :3] -= 0.04 * dt * dt * simulation.twists[:, :3]  # it moves at the lower speed
                simulation.twists[:, :3] *= 1 - 0.04 * dt

            simulation._step = slower
            return simulation

    return Dragged()


def test_receipts_of_rebound_in_impacts_and_of_friction(toy):
    everything = [slip.quantity for slip in receipts(toy(), "default", IMPACT, DT)]
    assert everything == list(QUANTITIES)
    assert set(QUANTITIES) - set(by_quantity(receipts(toy(), "default", REST, DT))) == {"restitution"}
    smooth = by_quantity(receipts(toy(), "default", SMOOTH, DT))
    assert set(QUANTITIES) - set(smooth) == {"friction", "friction_impulse"}


def test_requested_values_equal_to_the_scene_s_needs(toy):
    slips = by_quantity(receipts(toy(), "default", IMPACT, DT))
    assert slips["restitution"].asked == slips["restitution"].declared == 0.8
    assert slips["friction"].asked == slips["friction"].declared == 0.5
    assert slips["linear_damping"].asked == slips["sampling"].asked == 0.0
    assert slips["mass"].asked == slips["turn"].asked == 1.0


def test_receipts_of_a_healthy_engine_to_round_off(toy):
    for quantity, slip in by_quantity(receipts(toy(), "default", IMPACT, DT)).items():
        if quantity != "size":  # told to a step of motion only
            assert slip.measured == pytest.approx(slip.asked, abs=1e-8)  # 30 sweeps over four corners leave 1e-9


def test_settings_and_step_of_probes(toy_class):
    seen = set()

    class Spy(toy_class):
        @property
        def profiles(self):
            return {"default": lambda needs, dt: [Setting("iterations", round(10 * needs.top_speed), "seen here")]}

        def build(self, scene, dt, settings):
            seen.add((settings["iterations"], dt, scene.name))
            return super().build(scene, dt, settings)

    receipts(Spy(), "default", IMPACT, DT)
    assert seen == {(60, DT, f"probe_{name}") for name in PROBES}
    seen.clear()
    receipts(Spy(), "default", IMPACT, DT, iterations=12)
    assert {iterations for iterations, _, _ in seen} == {12}


@pytest.fixture
def counting(toy_class):
    """A toy engine, and the names of the scenes of which it has built a world."""
    builds = []

    class Counting(toy_class):
        def build(self, scene, dt, settings):
            builds.append(scene.name)
            return super().build(scene, dt, settings)

    return Counting(), builds


def test_probes_are_measured_once_per_configuration(counting):
    engine, builds = counting
    first = receipts(engine, "default", IMPACT, DT)
    assert len(builds) == len(PROBES)
    # top_speed chooses no setting of the toy: the same configuration.
    assert receipts(engine, "default", replace(IMPACT, top_speed=1.0), DT) == first
    assert len(builds) == len(PROBES)
    # Another pair is measured anew where bodies meet, another dimension everywhere.
    builds.clear()
    receipts(engine, "default", replace(IMPACT, restitution=0.3), DT)
    assert builds == ["probe_landing", "probe_rebound", "probe_slide", "probe_corner"]
    builds.clear()
    receipts(engine, "default", replace(IMPACT, dimension=3), DT)
    assert len(builds) == len(PROBES)


def test_declared_departure_right_and_wrong():
    # A rebound of 0 whatever is asked, and drag: (1 - 0.04 dt)^(1/dt) loses 0.0392 a second.
    plastic = declaring("restitution ignored", restitution=Declared(0.0, 1e-12, "no rebound"))
    assert all(slip.holds for slip in receipts(plastic, "default", IMPACT, DT))
    wrong = declaring("restitution ignored", restitution=Declared(0.1, 0.05, "no rebound"))
    slip = by_quantity(receipts(wrong, "default", IMPACT, DT))["restitution"]
    assert (slip.asked, slip.declared, slip.measured, slip.holds) == (0.8, 0.1, pytest.approx(0.0, abs=1e-12), False)


def test_declared_drag_widens_only_what_it_slows():
    hidden = receipts(dragged(), "default", IMPACT, DT)
    assert {slip.quantity for slip in hidden if not slip.holds} >= {"linear_damping", "gravity", "mass"}
    loss = Declared(1 - (1 - 0.04 * DT) ** 60, 1e-12, "4 % of the speed a second")
    # The rebound is read 7 steps and 0.2 s after the start: drag takes 1.3 % of 0.8 on the way.
    slower = Declared(0.8, 0.011, "drag on the way")
    # The box slides from 5.8 to 3.2 m/s in half a second: 4 % of 4.5 m/s a second, over a friction of 4.9 m/s^2.
    rubbed = Declared(0.5 * (1.0 + 0.04 * 4.5 / 4.9), 0.5 * 0.002, "drag on the way")
    stated = dragged(linear_damping=loss, restitution=slower, friction=rubbed)
    slips = by_quantity(receipts(stated, "default", IMPACT, DT))
    assert [slip.quantity for slip in slips.values() if not slip.holds] == []
    assert slips["inertia"].band == slips["step"].band == 1e-12
    # 4 %/s over 8 steps of 1/60 s at up to 1.3 m/s: under a percent, so that a sign or a factor still shows.
    assert 1e-3 < slips["gravity"].band < 1e-2


def test_refusal_of_a_quantity_without_a_probe():
    with pytest.raises(EngineError, match="declares 'viscosity'"):
        receipts(declaring(viscosity=Declared(1.0, 0.1)), "default", IMPACT, DT)


def test_refused_probe_as_nan_with_its_reason(toy_class):
    class Picky(toy_class):
        def refuses(self, scene, profile):
            return "no gravity here" if any(scene.gravity) else None

    slips = by_quantity(receipts(Picky(), "default", IMPACT, DT))
    for quantity in ("gravity", "step", "sampling", "friction", "friction_impulse"):
        assert math.isnan(slips[quantity].measured)
        assert slips[quantity].holds
        assert slips[quantity].because.endswith("refused: no gravity here")
    assert slips["mass"].measured == pytest.approx(1.0, abs=1e-12)


def test_exploding_probe_fails(toy_class):
    class Exploding(toy_class):
        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            simulation.twists[-1, 0] = math.nan
            return simulation

    slips = receipts(Exploding(), "default", SMOOTH, DT)
    assert not any(slip.holds for slip in slips)
    assert "diverged: the state is not finite" in slips[0].because


def test_wrong_step_order_as_one_step_of_delay(toy_class):
    class Mistaken(toy_class):
        facts = replace(toy_class.facts, scheme=Scheme("said to move bodies first", -1))

    slip = by_quantity(receipts(Mistaken(), "default", SMOOTH, DT))["sampling"]
    # x(+1) - x(-1) = g t dt, the path of one step.
    assert slip.measured == pytest.approx(-1.0, abs=1e-12)
    assert not slip.holds


def test_friction_told_above_the_tipping_of_a_cube(toy):
    slip = by_quantity(receipts(toy(), "default", replace(REST, friction=2.0), DT))["friction"]
    assert slip.measured == pytest.approx(2.0, abs=1e-6)  # four corners, 30 sweeps


@pytest.mark.parametrize("dimension", [2, 3])
def test_phase_at_which_probe_balls_touch_the_floor(dimension):
    scene = PROBES["rebound"].make(Case(dimension, 0.8, 0.0, DT, 1))
    for body, phase in zip(scene.bodies[1:], REBOUND_PHASES, strict=True):
        steps = (body.pose[dimension - 1] - body.shape.radius) / (REBOUND_SPEED * DT)
        assert steps % 1.0 == pytest.approx(phase, abs=1e-9)


def test_friction_bands_wider_at_few_requested_sweeps(toy):
    own, starved = (by_quantity(receipts(toy(), "default", IMPACT, DT, n)) for n in (None, 2))
    widened = {quantity for quantity in own if starved[quantity].band > own[quantity].band}
    assert widened == {"friction", "friction_impulse"}
    assert all(slip.holds for slip in starved.values())


def test_landing_stopped_early_by_a_single_sweep(toy):
    own, one = (by_quantity(receipts(toy(), "default", IMPACT, DT, n))["size"] for n in (None, 1))
    assert one.band - own.band == pytest.approx(LANDING_SPEED * DT / HALF_EXTENTS[0])


def test_doubled_friction_seen_despite_few_sweeps(toy):
    slip = by_quantity(receipts(toy("friction too high"), "default", IMPACT, DT, 4))["friction"]
    assert not slip.holds


def test_unreported_impulses_neither_zero_nor_a_failure(toy_class):
    class Silent(toy_class):
        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            told = simulation.contacts

            def contacts():
                found = told()
                found.impulse[:] = math.nan
                return found

            simulation.contacts = contacts
            return simulation

    slips = by_quantity(receipts(Silent(), "default", IMPACT, DT))
    for quantity in ("impulse", "friction_impulse"):
        assert math.isnan(slips[quantity].measured) and slips[quantity].holds
        assert "not reported" in slips[quantity].because
    assert slips["friction"].measured == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("quantity", ["friction", "friction_impulse", "impulse"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
def test_default_receipt_band_of_a_thousandth(toy, dt, quantity):
    slip = by_quantity(receipts(toy(), "default", IMPACT, dt))[quantity]
    assert slip.band < 1e-3 * slip.asked


# ---- bands, worked out once more -----------------------------------------------------------------------------------


def rate(loss):
    """Rate [1/s] of an exponential that loses ``loss`` of a speed in a second."""
    return -math.log(1.0 - loss)


def jolts(epsilon):
    """Speed of a corner .5 m up and .5 m out that is set right in a step, times 1.8, over that of g in a step."""
    return 1.8 * (0.5 * epsilon * (0.5 + 0.5) / DT) / (9.81 * DT)


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("needs", [IMPACT, REST], ids=["rebound", "rest"])
@pytest.mark.parametrize(
    ("fault", "quantity"),
    [("mass", "mass"), ("inertia", "inertia"), ("gravity", "gravity"), ("friction", "friction"),
     ("friction", "friction_impulse"), ("restitution", "restitution"), ("impulse", "impulse"), ("step", "step"),
     ("damping", "linear_damping"), ("damping", "angular_damping"), ("extent", "size")],
)  # fmt: skip
def test_property_of_one_per_cent_less(precision, needs, fault, quantity):
    """At 1/240 s every band notices it, with eight steps of the engine's own in a step."""

    class Made(ToyEngine):
        facts = replace(ToyEngine.facts, precision=precision)

        def scheme(self, profile):
            return Scheme("eight substeps", 1 / 8) if precision == "single" and quantity.startswith("fric") else SEMI

    needs = IMPACT if quantity == "restitution" else needs
    slips = by_quantity(receipts(Planted(Made(), fault, 0.01), "default", needs, 1 / 240))
    assert not slips[quantity].holds
    in_output = fault in ("impulse", "damping")
    assert contradictions(list(slips.values())) == [] or in_output


def test_bands_of_properties_realised_as_requested():
    slips = by_quantity(receipts(declaring(), "default", IMPACT, DT))
    # A box of half extent 0.3 m lands at 0.25 m/s and may leave at 0.8 of it: one step of both.
    said = {
        "turn": (0.0, "a sign"),
        "size": (1.8 * 0.25 * DT / 0.3 + 1e-12, "one step of motion, and a predicted rebound"),
        "impulse": (1e-6, "reported impulses must sum to m dv, up to the solver's tolerance"),
        "friction": (
            0.5e-4 + 1e-12 + 0.5 * jolts(2.0**-52),
            "a sliding box is solved to a share of 1e-4 of its friction, and the rounding of its position rebounds",
        ),
    }
    said["friction_impulse"] = said["friction"]
    for quantity, slip in slips.items():
        band, because = said.get(quantity, (1e-12, "exact up to round-off"))
        assert (slip.band, slip.because) == (pytest.approx(band, rel=1e-12), because), quantity


def test_bands_of_an_engine_in_single_precision():
    class Single(ToyEngine):
        facts = replace(ToyEngine.facts, precision="single")

    slips = by_quantity(receipts(Single(), "default", IMPACT, DT))
    round_off = 1e-12 * 2.0**29
    assert slips["mass"].band == slips["impulse"].band == pytest.approx(round_off)
    assert slips["friction"].band == pytest.approx(0.5e-4 + round_off + 0.5 * jolts(2.0**-23))
    rests = by_quantity(receipts(Single(), "default", REST, DT))
    assert rests["friction"].band == pytest.approx(0.5e-4 + round_off)
    assert slips["size"].band == pytest.approx(1.8 * 0.25 * DT / 0.3 + round_off)


def test_linear_and_angular_drag_widen_their_own_bands():
    slips = by_quantity(receipts(declaring(angular_damping=Declared(0.2, 0.0)), "default", IMPACT, DT))
    assert slips["gravity"].band == slips["linear_damping"].band == 1e-12 < slips["inertia"].band
    slips = by_quantity(receipts(declaring(linear_damping=Declared(0.04, 0.01)), "default", IMPACT, DT))
    assert slips["inertia"].band == slips["angular_damping"].band == 1e-12 < slips["gravity"].band


def test_total_drag_taken_as_a_loss_of_99_in_100():
    slips = by_quantity(receipts(declaring(linear_damping=Declared(1.0, 5.0)), "default", IMPACT, DT))
    assert slips["impulse"].band == pytest.approx(rate(0.99) * 12 * DT + 1e-6)


@pytest.mark.parametrize(
    ("sweeps", "left"),
    # One sweep: from no friction to a stop within the window, in which twice the friction takes 0.85 of the speed.
    [(1, 2.0 * 0.5 / 0.85), (2, 0.25), (10, 0.05)],
)
def test_friction_loss_at_requested_sweeps(sweeps, left):
    own = {"friction_impulse": Declared(0.45, 0.125, "it is so")}
    slips = by_quantity(receipts(declaring(**own), "default", IMPACT, DT, sweeps))
    wider = left + 2 * DT / 0.5 * 0.5
    assert slips["friction"].band == pytest.approx(0.5e-4 + wider)
    impulse = slips["friction_impulse"]
    assert (impulse.asked, impulse.declared, impulse.band) == (0.5, 0.45, pytest.approx(0.125 + wider))
    assert impulse.because == f"it is so; {sweeps} iterations are set, and a load may be off by 1/{sweeps}"
    assert slips["impulse"].band == 1e-6  # of an engine that is moved by its impulses


def test_declared_impulse_sum_not_told_in_an_unfinished_solve():
    engine = declaring(impulse=Declared(0.98, 0.01, "left by its solver"))
    slip = by_quantity(receipts(engine, "default", IMPACT, DT, 5))["impulse"]
    assert (slip.asked, slip.declared, slip.band, slip.holds) == (1.0, 0.98, 1e9, True)
    assert slip.because == "left by its solver; 5 iterations are set: no prediction"
    own = by_quantity(receipts(engine, "default", IMPACT, DT))["impulse"]
    assert (own.declared, own.band, own.because, own.holds) == (0.98, 0.01, "left by its solver", False)


# ---- which sample counts -------------------------------------------------------------------------------------------


def told_wrong(probe, factor):
    """An engine whose reported impulses are off by ``factor`` on one probe."""

    class Wrong(ToyEngine):
        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            told = simulation.contacts

            def contacts():
                found = told()
                found.impulse[:] *= factor
                return found

            if scene.name == f"probe_{probe}":
                simulation.contacts = contacts
            return simulation

    return Wrong()


@pytest.mark.parametrize("probe", ["landing", "slide"])
def test_farthest_sample_of_all_probes(probe):
    slip = by_quantity(receipts(told_wrong(probe, 1.5), "default", IMPACT, DT))["impulse"]
    assert slip.measured == pytest.approx(1.5) and not slip.holds


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_nan_sample_as_the_farthest():
    slip = by_quantity(receipts(told_wrong("landing", math.inf), "default", IMPACT, DT))["impulse"]
    assert not math.isfinite(slip.measured) and not slip.holds


def test_quantity_after_a_refused_probe():
    class Picky(ToyEngine):
        def refuses(self, scene, profile):
            return "no corners" if scene.name == "probe_corner" else None

    slip = by_quantity(receipts(Picky(), "default", IMPACT, DT))["turn"]
    assert (slip.measured, slip.holds, slip.because) == (1.0, True, "a sign")

    class Exploding(ToyEngine):
        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            if scene.name == "probe_corner":
                simulation.twists[-1, 0] = math.nan
            return simulation

    slip = by_quantity(receipts(Exploding(), "default", IMPACT, DT))["turn"]
    assert math.isnan(slip.measured) and not slip.holds
    assert (slip.asked, slip.declared, slip.band) == (1.0, 1.0, 0.0)
    assert slip.because.startswith("probe corner diverged: the state is not finite")


def test_unmeasured_quantity_with_its_asked_and_declared_value():
    class Deaf(ToyEngine):
        def refuses(self, scene, profile):
            return "no floor" if scene.name in ("probe_slide", "probe_landing") else None

        def declares(self, profile, needs, dt):
            return {"friction": Declared(0.25, 0.125, "half of it")}

    slip = by_quantity(receipts(Deaf(), "default", IMPACT, DT))["friction"]
    assert (slip.asked, slip.declared, slip.band, slip.holds) == (0.5, 0.25, 0.125, True)
    assert slip.because == "probe slide refused: no floor"
    silent = by_quantity(receipts(told_wrong("slide", math.nan), "default", IMPACT, DT))["friction_impulse"]
    assert (silent.asked, silent.declared) == (0.5, 0.5) and silent.band == pytest.approx(0.5e-4)
    assert silent.because == "contact impulses are not reported at these settings" and silent.holds


# ---- what the engine is asked --------------------------------------------------------------------------------------


def test_receipts_asked_with_the_judged_profile_needs_and_step():
    asked = []

    class Asked(ToyEngine):
        @property
        def profiles(self):
            return dict.fromkeys(("default", "other"), self.chosen)

        def settings(self, profile, needs, dt, iterations=None):
            asked.append(("settings", profile, needs, dt))
            return super().settings(profile, needs, dt, iterations)

        def chosen(self, needs, dt):
            return [Setting("iterations", 30, "enough")]

        def declares(self, profile, needs, dt):
            asked.append(("declares", profile, needs, dt))
            return {}

        def refuses(self, scene, profile):
            asked.append(("refuses", profile))  # by the toy itself as well, of no profile
            return None

        def scheme(self, profile):
            asked.append(("scheme", profile))
            return super().scheme(profile)

    receipts(Asked(), "other", IMPACT, DT)
    assert set(asked) - {("refuses", "")} == {
        ("settings", "other", IMPACT, DT),
        ("declares", "other", IMPACT, DT),
        ("refuses", "other"),
        ("scheme", "other"),
    }


def test_free_bodies_measured_once_for_all_frictions(counting):
    engine, builds = counting
    receipts(engine, "default", IMPACT, DT)
    builds.clear()
    receipts(engine, "default", replace(IMPACT, friction=0.25), DT)
    assert builds == ["probe_landing", "probe_rebound", "probe_slide", "probe_corner"]
    receipts(engine, "default", replace(IMPACT, friction=3.0), DT)
    builds.clear()  # above `MOST_FRICTION` only what reads friction has more of it
    receipts(engine, "default", replace(IMPACT, friction=8.0), DT)
    assert builds == ["probe_rebound", "probe_slide"]


class Yielding(ToyEngine):
    """An engine whose contacts give way the more, the larger their friction: a property of it, not of its adapter."""

    def build(self, scene, dt, settings):
        simulation = super().build(scene, dt, settings)
        friction = max(pair.friction for pair in scene.pairs)
        step = simulation._step

        def softer(dt):
            before = simulation.twists.copy()
            step(dt)
            simulation.twists[1:] = before[1:] + (simulation.twists[1:] - before[1:]) / (1.0 + 10.0 * friction)

        simulation._step = softer if friction > 5.0 else step
        return simulation


def test_contacts_softened_by_friction_have_the_right_size():
    slips = by_quantity(receipts(Yielding(), "default", replace(REST, friction=8.0), DT))
    for quantity in ("size", "turn", "mass", "gravity", "step"):
        assert slips[quantity].holds


@pytest.mark.parametrize("friction", [0.01, 0.3, 1.0, 8.0, 40.0])
@pytest.mark.parametrize("dimension", [2, 3])
def test_box_speed_in_the_friction_window(friction, dimension):
    scene = PROBES["slide"].make(Case(dimension, 0.0, friction, DT, 1))
    speed, down = scene.bodies[1].twist[0], -scene.gravity[dimension - 1]
    assert 3.0 <= speed <= 11.6  # 2 * 9.81 m/s^2 * 0.5 s / 0.85
    assert speed - 2.0 * friction * down * 0.5 > 0.0


STOCK = (("bullet", "default"), ("bullet", "tuned"), ("mujoco", "default"), ("mujoco", "tuned"),
         pytest.param("dart", "default", marks=pytest.mark.optional("dart")))  # fmt: skip


@pytest.mark.parametrize(("engine", "profile"), STOCK)
@pytest.mark.parametrize("friction", [0.001, 0.01, 8.0, 25.0])
@pytest.mark.parametrize("dt", [1 / 240, 1 / 60])
def test_measurement_at_unusual_frictions(engine, profile, friction, dt):
    found = find(engine)
    if found.engine is None:
        pytest.skip(found.reason)
    if friction > 10.0 and engine == "bullet":
        pytest.skip("bullet refuses it")
    asked = replace(REST, dimension=3, friction=friction)
    assert [slip.quantity for slip in receipts(found.engine, profile, asked, dt) if not slip.holds] == []


@pytest.mark.optional("dart")
@pytest.mark.parametrize("friction", [5.0, 10.0, 100.0])
@pytest.mark.parametrize("asked", [REST, IMPACT], ids=["rest", "impact"])
def test_friction_measured_with_a_solver_that_stops_early(asked, friction):
    asked = replace(asked, dimension=3, friction=friction)
    assert all(slip.holds for slip in receipts(find("dart").engine, "fbf", asked, DT))


@pytest.mark.parametrize("profile", ["tuned", "one"])
def test_measurement_with_intermittent_points_at_high_friction(profile):
    pytest.importorskip("pybullet")
    asked = replace(REST, dimension=3, friction=10.0)
    assert all(slip.holds for slip in receipts(find("bullet").engine, profile, asked, 1 / 1000))


@pytest.mark.parametrize(("friction", "breaks"), [(0.5, True), (1.0, True), (1.5, False), (40.0, False)])
def test_friction_above_one_measured_and_left_to_checks(toy_class, friction, breaks):
    """A weight more than the body's own brakes it: solvers stop early there, which is a fault of theirs."""

    class Early(toy_class):
        def build(self, scene, dt, settings):
            less = tuple(replace(pair, friction=0.99 * pair.friction) for pair in scene.pairs)
            return super().build(replace(scene, pairs=less), dt, settings)

    slip = by_quantity(receipts(Early(), "default", replace(REST, friction=friction), DT))["friction"]
    assert slip.measured == pytest.approx(0.99 * friction, rel=1e-3) and slip.holds != breaks


@pytest.mark.parametrize("friction", [0.5, 3.0, 10.0, 50.0, 1000.0])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 1000])
def test_measurement_of_balls_sinking_through_soft_pyramids(friction, dt):
    """Edges of a pyramid of much friction are so soft that balls are still on their way in when the probe ends."""
    pytest.importorskip("mujoco")
    asked = replace(IMPACT, dimension=3, friction=friction, restitution=0.5)
    slip = by_quantity(receipts(find("mujoco").engine, "default", asked, dt))["restitution"]
    assert slip.holds and (slip.measured < 0.0) == (friction >= 10.0)


@pytest.mark.few(4)
@pytest.mark.parametrize("friction", [0.0, 1e-5, 0.3])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 2000, 1 / 10000])
def test_stiff_friction_pyramid_forces_to_round_off(friction, dt):
    """As shipped a pair without friction has edges of mu = 1e-5: 1e12 times as stiff as its bodies are heavy."""
    pytest.importorskip("mujoco")
    told = by_quantity(receipts(find("mujoco").engine, "default", replace(REST, dimension=3, friction=friction), dt))
    assert told["impulse"].holds and told["impulse"].band <= 0.01


def test_settings_as_lists_of_lists(toy_class):
    class Listing(toy_class):
        @property
        def profiles(self):
            return {"default": lambda needs, dt: [Setting("iterations", 30, ""), Setting("solref", given, "")]}

        def build(self, scene, dt, settings):
            seen.append(settings["solref"])
            return super().build(scene, dt, {"iterations": settings["iterations"]})

    seen, given = [], [0.5, [1, "a"]]
    receipts(Listing(), "default", SMOOTH, DT)
    assert set(seen) == {(0.5, (1, "a"))}
    given = [1, {"a": 2}]
    with pytest.raises(EngineError, match=r"^settings: a setting is a number, a word or a list of them, not a table$"):
        receipts(Listing(), "default", SMOOTH, DT)


@pytest.mark.parametrize(
    ("samples", "counts"),
    [((1.05, 0.7), 0.7), ((0.7, 1.05), 0.7), ((0.95, 1.35), 1.35), ((1.05, math.nan), None), ((math.nan, 0.0), None)],
)
def test_receipt_sample_farthest_from_the_declared_value(samples, counts):
    found = _receipt("mass", 1.0, Declared(1.0, 0.1), samples, None)
    assert not found.holds
    assert math.isnan(found.measured) if counts is None else found.measured == counts


def test_side_effects_of_a_single_sweep_told():
    case, told = Case(2, 0.8, 0.0, DT, 1), Declared(1.0, 0.01, "a landing")
    found = _starved("size", told, case, 1, False)
    assert found.value == 1.0 and found.band == pytest.approx(0.01 + LANDING_SPEED * case.dt / HALF_EXTENTS[0])
    assert found.because == "a landing; with 1 iteration: a step of motion more"
    assert _starved("size", told, case, 2, False) == told


def test_declared_drag_widens_bands_by_its_loss():
    told = {"linear_damping": Declared(0.04, 0.01), "angular_damping": Declared(0.2, 0.0)}
    slips = by_quantity(receipts(declaring(**told), "default", IMPACT, DT))
    window = 8 * DT  # at up to 1.3 m/s, and drag may grow with the square of a speed above 1 m/s
    fastest = 9.81 * window
    share = rate(0.05) * window * fastest
    assert slips["gravity"].band == slips["mass"].band == pytest.approx(share + 1e-12)
    assert slips["inertia"].band == pytest.approx(rate(0.2) * window * fastest + 1e-12)
    assert slips["sampling"].band == pytest.approx(8 * share + 1e-12)
    assert slips["impulse"].band == pytest.approx(rate(0.05) * 12 * DT + 1e-6)  # 5.5 steps down, 5.5 up, one of contact
    assert slips["gravity"].because == "exact up to round-off; and declared drag"
    assert slips["turn"].band == 0.0 and slips["size"].band == pytest.approx(1.8 * 0.25 * DT / 0.3 + 1e-12)
    for untouched in ("step", "restitution"):
        assert (slips[untouched].band, slips[untouched].because) == (1e-12, "exact up to round-off")
    assert slips["friction"].band == slips["friction_impulse"].band == pytest.approx(0.5e-4 + 1e-12)
    for damping in ("linear_damping", "angular_damping"):
        assert slips[damping].band == told[damping].band
    finer = by_quantity(receipts(declaring(**told), "default", IMPACT, 1 / 960))
    assert finer["gravity"].band == pytest.approx(rate(0.05) * 8 / 960 + 1e-12)  # slower than 1 m/s: not less than 1


@pytest.mark.parametrize(
    ("engine", "profile", "asked"),
    [
        pytest.param("box2d3", "tuned", replace(IMPACT, restitution=0.9, friction=0.6, gravity=0.0, pull=0.0),
                     marks=pytest.mark.optional("box2d3")),
        pytest.param("rapier", "default", replace(IMPACT, dimension=3, restitution=1.0, friction=1.0),
                     marks=pytest.mark.optional("rapier")),
        pytest.param("drake", "similar", replace(REST, dimension=3, friction=0.002),
                     marks=pytest.mark.optional("drake")),
    ],
)  # fmt: skip
def test_friction_off_by_round_off_and_residual(engine, profile, asked):
    found = find(engine).engine
    assert found is not None
    slips = [slip for slip in receipts(found, profile, asked, 1 / 240) if slip.quantity.startswith("friction")]
    assert slips and all(slip.holds for slip in slips)


# ---- a finding about the engine, or a measurement that contradicts itself ----


def off(quantity, measured, band=1e-6):
    declared = {"sampling": 0.0, "linear_damping": 0.0, "friction": 0.5, "friction_impulse": 0.5, "restitution": 0.8}
    return Receipt(quantity, declared.get(quantity, 1.0), declared.get(quantity, 1.0), band, measured, False, "exact")


@pytest.mark.parametrize(
    "slips",
    [
        [("mass", 0.9)],
        [("restitution", 0.72)],
        [("friction", 0.45), ("friction_impulse", 0.45)],
        [("mass", 0.9), ("impulse", 0.9)],
        [("gravity", 1.1), ("step", 1.1), ("sampling", -0.9)],
        [("gravity", 0.9), ("sampling", 0.8), ("impulse", 0.9)],
        [("linear_damping", 0.04), ("sampling", 0.01), ("impulse", 0.999), ("gravity", 0.998)],
    ],
    ids=lambda slips: " ".join(quantity for quantity, _ in slips),
)
def test_property_realised_with_another_value(slips):
    assert contradictions([off(*slip) for slip in slips]) == []


@pytest.mark.parametrize(
    ("slips", "said"),
    [
        ([("step", 0.9)], "positions do not follow from velocities and times: step is 0.9, declared 1 +- 1e-06"),
        ([("sampling", 1.0)], "states are not those of their times"),
        ([("impulse", 0.9)], "reported impulses do not sum to the change of momentum"),
        ([("friction_impulse", 0.4)], "reported friction is not that which brakes"),
        ([("friction", 0.45), ("friction_impulse", 0.3)], "reported friction is not that which brakes"),
        ([("turn", -1.0)], "angles and spins have another sign than torques"),
        # Speeds read a fifth too large: more gravity, and shorter ways for them.
        ([("gravity", 1.2), ("sampling", -1.6), ("step", 1 / 1.2)], "positions do not follow"),
        ([("mass", 0.9), ("impulse", 1.2)], "reported impulses do not sum"),
        ([("mass", math.nan)], "mass is not a number: exact"),
    ],
)
def test_record_that_contradicts_itself(slips, said):
    (found,) = contradictions([off(*slip) for slip in slips])
    assert found.startswith(said)


def test_table_of_contradictions_names_quantities():
    assert set(RECORDED) < set(QUANTITIES)
    assert {cause for _, causes in RECORDED.values() for cause in causes} < set(QUANTITIES) - set(RECORDED)
