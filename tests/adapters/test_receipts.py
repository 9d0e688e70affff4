"""Receipts: what is measured, at which settings, against what, and what a refusal means."""

import math
from dataclasses import replace

import pytest

from adapters.conformance.spoilt import Spoilt
from adapters.conformance.toy import ToyEngine
from adapters.engine import Declared, EngineError, Scheme, Setting
from adapters.needs import Needs
from adapters.probes import PROBES, REBOUND_PHASES, REBOUND_SPEED, Case
from adapters.receipts import QUANTITIES, receipts

DT = 1 / 60
IMPACT = Needs(2, True, 0.5, 0.8, "impact", True, 1.0, 6.0, 1.0, 9.81)
REST = Needs(2, True, 0.5, 0.0, "rest", False, 1.0, 6.0, 1.0, 9.81)
SMOOTH = Needs(2, False, 0.0, 0.8, "impact", False, 1.0, 6.0, 1.0, 9.81)


def by_quantity(slips):
    return {slip.quantity: slip for slip in slips}


def declaring(fault="", **declared):
    class Declaring(Spoilt if fault else ToyEngine):
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


def test_rebounds_are_measured_in_impacts_and_friction_where_there_is_any(toy):
    everything = [slip.quantity for slip in receipts(toy(), "default", IMPACT, DT)]
    assert everything == list(QUANTITIES)
    assert set(QUANTITIES) - set(by_quantity(receipts(toy(), "default", REST, DT))) == {"restitution"}
    smooth = by_quantity(receipts(toy(), "default", SMOOTH, DT))
    assert set(QUANTITIES) - set(smooth) == {"friction", "friction_impulse"}


def test_asked_is_what_the_scene_needs(toy):
    slips = by_quantity(receipts(toy(), "default", IMPACT, DT))
    assert slips["restitution"].asked == slips["restitution"].declared == 0.8
    assert slips["friction"].asked == slips["friction"].declared == 0.5
    assert slips["linear_damping"].asked == slips["sampling"].asked == 0.0
    assert slips["mass"].asked == slips["turn"].asked == 1.0


def test_a_healthy_engine_is_measured_to_round_off(toy):
    for quantity, slip in by_quantity(receipts(toy(), "default", IMPACT, DT)).items():
        if quantity != "size":  # told to a step of motion only
            assert slip.measured == pytest.approx(slip.asked, abs=1e-8)  # 30 sweeps over four corners leave 1e-9


def test_probes_run_at_the_settings_and_the_step_of_the_judged_scene(toy_class):
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


def test_probes_are_measured_once_per_configuration(toy_class):
    builds = []

    class Counting(toy_class):
        def build(self, scene, dt, settings):
            builds.append(scene.name)
            return super().build(scene, dt, settings)

    engine = Counting()
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


def test_a_departure_that_is_declared_holds_and_one_that_is_declared_wrong_does_not():
    # A rebound of 0 whatever is asked, and drag: (1 - 0.04 dt)^(1/dt) loses 0.0392 a second.
    plastic = declaring("restitution ignored", restitution=Declared(0.0, 1e-12, "no rebound"))
    assert all(slip.holds for slip in receipts(plastic, "default", IMPACT, DT))
    wrong = declaring("restitution ignored", restitution=Declared(0.1, 0.05, "no rebound"))
    slip = by_quantity(receipts(wrong, "default", IMPACT, DT))["restitution"]
    assert (slip.asked, slip.declared, slip.measured, slip.holds) == (0.8, 0.1, pytest.approx(0.0, abs=1e-12), False)


def test_declared_drag_widens_what_it_slows_and_nothing_else():
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


def test_a_quantity_that_no_probe_measures_cannot_be_declared():
    with pytest.raises(EngineError, match="declares 'viscosity'"):
        receipts(declaring(viscosity=Declared(1.0, 0.1)), "default", IMPACT, DT)


def test_a_refused_probe_gives_nan_and_the_reason_and_is_no_failure(toy_class):
    class Picky(toy_class):
        def refuses(self, scene, profile):
            return "no gravity here" if any(scene.gravity) else None

    slips = by_quantity(receipts(Picky(), "default", IMPACT, DT))
    for quantity in ("gravity", "step", "sampling", "friction", "friction_impulse"):
        assert math.isnan(slips[quantity].measured)
        assert slips[quantity].holds
        assert slips[quantity].because.endswith("refused: no gravity here")
    assert slips["mass"].measured == pytest.approx(1.0, abs=1e-12)


def test_a_probe_that_explodes_does_not_hold(toy_class):
    class Exploding(toy_class):
        def build(self, scene, dt, settings):
            simulation = super().build(scene, dt, settings)
            simulation.twists[-1, 0] = math.nan
            return simulation

    slips = receipts(Exploding(), "default", SMOOTH, DT)
    assert not any(slip.holds for slip in slips)
    assert "diverged: the state is not finite" in slips[0].because


def test_a_step_order_other_than_stated_is_one_step_of_delay(toy_class):
    class Mistaken(toy_class):
        facts = replace(toy_class.facts, scheme=Scheme("said to move bodies first", -1))

    slip = by_quantity(receipts(Mistaken(), "default", SMOOTH, DT))["sampling"]
    # x(+1) - x(-1) = g t dt, the path of one step.
    assert slip.measured == pytest.approx(-1.0, abs=1e-12)
    assert not slip.holds


def test_friction_is_told_above_the_coefficient_at_which_a_cube_tips(toy):
    slip = by_quantity(receipts(toy(), "default", replace(REST, friction=2.0), DT))["friction"]
    assert slip.measured == pytest.approx(2.0, abs=1e-6)  # four corners, 30 sweeps


@pytest.mark.parametrize("dimension", [2, 3])
def test_probe_balls_touch_the_floor_at_their_phase_of_a_step(dimension):
    scene = PROBES["rebound"].make(Case(dimension, 0.8, 0.0, DT, 1))
    for body, phase in zip(scene.bodies[1:], REBOUND_PHASES, strict=True):
        steps = (body.pose[dimension - 1] - body.shape.radius) / (REBOUND_SPEED * DT)
        assert steps % 1.0 == pytest.approx(phase, abs=1e-9)


def test_few_sweeps_that_were_asked_for_widen_the_bands_of_friction_alone(toy):
    own, starved = (by_quantity(receipts(toy(), "default", IMPACT, DT, n)) for n in (None, 2))
    widened = {quantity for quantity in own if starved[quantity].band > own[quantity].band}
    assert widened == {"friction", "friction_impulse"}
    assert all(slip.holds for slip in starved.values())


def test_friction_applied_twice_does_not_hide_behind_few_sweeps(toy):
    slip = by_quantity(receipts(toy("friction too high"), "default", IMPACT, DT, 4))["friction"]
    assert not slip.holds


def test_impulses_that_are_not_reported_are_no_zero_and_no_failure(toy_class):
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
def test_a_profile_that_declares_nothing_is_held_to_a_thousandth_of_friction_and_impulses(toy, dt, quantity):
    slip = by_quantity(receipts(toy(), "default", IMPACT, dt))[quantity]
    assert slip.band < 1e-3 * slip.asked
