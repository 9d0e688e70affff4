"""A scene in other units is the same scene: what it builds, its truths, bounds and measures change by their units.

Lengths, times and masses are told in other units: parameters by the unit that they state, the scenes' own sizes by
`SIZES`. Whatever is built, true, allowed or measured must then change by the power of each that its own unit says; a
length that is divided where it should be multiplied, or added to a speed, does not. Every verdict stays, for a value
and its bound are of one unit. Units are powers of 64, so that square and cube roots of them are exact as well.
"""

import importlib
import sys
from dataclasses import replace

import numpy as np
import pytest

from adapters.registry import load
from adapters.stepping import run
from adapters.trajectory import ContactRecord
from validation.catalogue import CATALOGUE
from validation.cells import Slot, settings_of

#: Other units of length, time and mass, one of them larger and one smaller.
UNITS = {"m": 64.0, "s": 1.0 / 64.0, "kg": 4096.0}
#: What a unit is made of, as powers of metre, second and kilogram; everything else is a plain number.
POWERS = {"m": (1, 0, 0), "s": (0, 1, 0), "h": (0, 1, 0), "kg": (0, 0, 1), "N": (1, -2, 1), "J": (2, -2, 1)}
NUMBERS = {"1", "deg", "degrees", "rad", "radii", "sides", "weights", "L"}
#: What errors of scenes are told in: sizes of the scene, and its own numbers.
NUMBERS |= {"side", "g", "depth", "dt", "mark", "h0", "radius", "block", "heights", "diameter", "way"}
#: Steps [s] at which bounds are stated.
DTS = (1 / 240, 1 / 1920)
#: Sizes that modules of scenes state themselves [m], and times [s].
SIZES = {
    "scenes.arch": {"m": "TALL KEY BASE NARROW SINKS", "s": "DURATION"},
    "scenes.bounce": {"m": "RADIUS", "s": "AFTERMATH"},
    "scenes.closing_wall": {"m": "THICKNESS WIDTH"},
    "scenes.conveyor": {"m": "HEIGHT"},
    "scenes.cradle": {"m": "RADIUS", "s": "AFTERMATH"},
    "scenes.domino": {"s": "AFTERMATH"},
    "scenes.edge_drop": {"m": "HEIGHT", "s": "AFTERMATH"},
    "scenes.far_origin": {"m": "HEIGHT THICKNESS"},
    "scenes.flat_box": {"m": "HEIGHT", "s": "AFTERMATH"},
    "scenes.flight": {"m": "SIDES RADIUS APART"},
    "scenes.galperin": {"m": "SMALL LARGE", "s": "AFTERMATH"},
    "scenes.head_on": {"m": "RADIUS", "s": "AFTERMATH"},
    "scenes.heavy_on_light": {"m": "SIDE"},
    "scenes.impact": {"s": "AFTERMATH"},
    "scenes.incline": {"m": "SIDE"},
    "scenes.kane": {"m": "LENGTH", "s": "AFTERMATH"},
    "scenes.long_rest": {"m": "SIDE", "s": "SETTLED"},
    "scenes.oblique": {"s": "AFTERMATH"},
    "scenes.off_centre": {"m": "RADIUS WIDTH HEIGHT", "s": "AFTERMATH"},
    "scenes.overhang": {"m": "LENGTH HEIGHT"},
    "scenes.overlap": {"m": "RADIUS"},
    "scenes.painleve": {"s": "AFTERMATH"},
    "scenes.pair_matrix": {"m": "RADIUS GAP LANE", "s": "AFTERMATH"},
    "scenes.pinch": {"m": "SIDE PAD", "s": "WINDOW"},
    "scenes.pivot": {"s": "AFTERMATH"},
    "scenes.position_correction": {"m": "SIDE"},
    "scenes.pressed_box": {"m": "SIDE", "s": "WINDOW"},
    "scenes.pyramid": {"m": "SIDE GAP"},
    "scenes.rack": {"m": "RADIUS", "s": "AFTERMATH"},
    "scenes.restitution_above_one": {"m": "RADIUS APART"},
    "scenes.rod_gas": {"m": "RADIUS"},
    "scenes.scales": {"1/s": "SPEED", "1/s^2": "GRAVITY"},
    "scenes.seam": {"m": "HEIGHT THICKNESS"},
    "scenes.shove": {"m": "UPPER LOWER CLEARANCE", "s": "DURATION"},
    "scenes.slide": {"m": "HEIGHT"},
    "scenes.stack": {"m": "SIDE", "s": "WINDOW"},
    "scenes.starved": {"m": "RADIUS", "s": "WINDOW"},
    "scenes.stacked_balls": {"m": "LARGE SMALL", "s": "AFTERMATH SOFT COARSEST"},
    "scenes.thin_wall": {"m": "WIDTH", "s": "AFTERMATH"},
    "scenes.tilt_table": {"s": "AFTERMATH DURATION"},
    "scenes.tumble": {"m": "SIDES"},
    "scenes.v_groove": {"m": "RADIUS", "s": "WINDOW"},
    "scenes.wedge": {"m": "FACE WIDTH HEIGHT LEFT", "s": "DURATION"},
    "scenes.wipe": {"m": "WIDTH HEIGHT", "s": "WINDOW"},
    "bounds": {"s": "WINDOW"},
    "truths.columns": {"s": "WINDOW"},
    "truths.corners": {"s": "AFTERMATH"},
    "truths.leaning": {"s": "AFTERMATH DURATION"},
}


def factor(unit):
    """What a number of this unit is multiplied by."""
    powers = np.zeros(3)
    for sign, part in zip((1, -1), unit.split("/"), strict=False):
        for word in part.split():
            name, _, power = word.partition("^")
            if name not in NUMBERS:
                powers += sign * float(power or 1) * np.array(POWERS[name])
    return float(np.prod(np.array([UNITS["m"], UNITS["s"], UNITS["kg"]]) ** powers))


def forget():
    """What a scene has computed once is of the units that it was computed in."""
    for name, module in list(sys.modules.items()):
        if name.startswith(("validation.scenes", "validation.truths")):
            for made in vars(module).values():
                getattr(made, "cache_clear", lambda: None)()


@pytest.fixture
def in_other_units(monkeypatch):
    """``in_other_units(canonical)`` tells the scenes' own sizes in other units from there on."""

    def tell():
        for name, sizes in SIZES.items():
            module = importlib.import_module(f"validation.{name}")
            for unit, words in sizes.items():
                for word in words.split():
                    size = getattr(module, word)
                    more = factor(unit)
                    told = tuple(more * x for x in size) if isinstance(size, tuple) else more * size
                    monkeypatch.setattr(module, word, told)
        forget()

    yield tell
    monkeypatch.undo()
    forget()


def cells(canonical):
    """Sets of parameters of the quick suite, complete, without those that differ by an iteration count alone."""
    found = [v.params for v in canonical.variations("standard")] + [canonical.representative, *canonical.planted]
    return list({tuple(sorted(p.items())): p for p in map(canonical.complete, found)}.values())


def other(canonical, params):
    """The same parameters in other units."""
    return {p.name: factor(p.unit) * params[p.name] for p in canonical.parameters}


def numbers(scene):
    """Every number of a scene that has a unit: name, unit, values."""
    d = scene.dimension
    yield "duration", "s", [scene.duration]
    yield "gravity", "m/s^2", scene.gravity
    for body in scene.bodies:
        free = body.motion == "free"
        yield f"{body.name}.place", "m", body.pose[:d]
        yield f"{body.name}.turned", "1", body.pose[d:]
        yield f"{body.name}.velocity", "m/s", body.twist[:d]
        yield f"{body.name}.spin", "1/s", body.twist[d:]
        yield f"{body.name}.surface_velocity", "m/s", body.surface_velocity
        if free:
            yield f"{body.name}.mass", "kg", [body.mass]
            yield f"{body.name}.inertia", "kg m^2", np.ravel(body.inertia)
            yield f"{body.name}.force", "N", body.force
            yield f"{body.name}.torque", "J", body.torque
        for name, size in vars(body.shape).items():
            sizes = np.ravel(size)
            if name == "half_extents" and not free:
                sizes = sizes[[0, -1]]  # across the plane of what happens a plate is as wide as it likes
            yield f"{body.name}.{name}", "1" if name == "normal" else "m", sizes
        if body.course is not None:
            yield f"{body.name}.amplitude", "m", np.ravel(body.course.amplitude)
            yield f"{body.name}.frequency", "1/s", [body.course.frequency]


@pytest.mark.parametrize("name", CATALOGUE)
def test_scene_by_units_of_its_parameters(name, in_other_units):
    canonical = CATALOGUE[name]
    asked = [(d, p) for d in canonical.dimensions for p in cells(canonical)]
    before = [list(numbers(canonical.make(d, p))) for d, p in asked]
    in_other_units()
    for (d, p), was in zip(asked, before, strict=True):
        for (what, unit, old), (_, _, new) in zip(was, numbers(canonical.make(d, other(canonical, p))), strict=True):
            assert new == pytest.approx(factor(unit) * np.array(old), rel=1e-12, abs=1e-13 * factor(unit)), (what, p)


@pytest.mark.parametrize("name", CATALOGUE)
def test_truth_and_bounds_in_other_units(name, in_other_units):
    canonical = CATALOGUE[name]
    asked = [(d, p, dt) for d in canonical.dimensions for p in cells(canonical) for dt in DTS]
    before = [canonical.checks(canonical.scene(d, p), dt) for d, p, dt in asked]
    in_other_units()
    for (d, p, dt), was in zip(asked, before, strict=True):
        scene = canonical.make(d, other(canonical, p))
        now = canonical.rule(scene, factor("s") * dt, canonical.exact(scene))
        for old, new in zip(was, now, strict=True):
            assert (old.metric, old.unit, old.bound is None) == (new.metric, new.unit, new.bound is None)
            if old.truth is not None:
                assert new.truth == pytest.approx(factor(old.unit) * old.truth, rel=1e-11), (old, p)
            if old.bound is not None:
                assert new.bound == pytest.approx(factor(old.unit) * old.bound, rel=1e-9), (old, p)


def retold(trajectory, d):
    """The same record in other units."""
    metres, speed, turns = factor("m"), factor("m/s"), factor("1/s")
    pose, twist = trajectory.pose.copy(), trajectory.twist.copy()
    pose[..., :d] *= metres
    twist[..., :d] *= speed
    twist[..., d:] *= turns
    contacts = trajectory.contacts
    if contacts is not None:
        rows = contacts.rows
        told = replace(rows, point=metres * rows.point, impulse=factor("N s") * rows.impulse, gap=metres * rows.gap)
        contacts = ContactRecord(contacts.step, contacts.offset, told)
    t, dt = factor("s") * trajectory.t, factor("s") * trajectory.dt
    return replace(trajectory, t=t, pose=pose, twist=twist, contacts=contacts, dt=dt)


@pytest.mark.parametrize("name", CATALOGUE)
def test_measures_and_verdicts_in_other_units(name, in_other_units):
    canonical, dt, found = CATALOGUE[name], DTS[0], []
    engine = load("chipmunk" if canonical.dimensions == (2,) else "mujoco")
    for d in canonical.dimensions:
        params = canonical.complete(canonical.representative)
        scene = canonical.make(d, params)
        slot = Slot(name, canonical.minimal(params), d, engine.facts.name, "tuned", dt)
        settings = {setting.name: setting.value for setting in settings_of(engine, slot, scene)}
        record = run(engine, scene, dt, settings, canonical.sampling(scene))
        checks = {check.metric: check for check in canonical.checks(scene, dt)}
        found.append((d, params, record, canonical.measure(scene, record), checks))
    if canonical.primary:
        errors = [canonical.primary.error(canonical.make(d, p), dt, seen) for d, p, _, seen, _ in found]
    in_other_units()
    for k, (d, params, record, seen, checks) in enumerate(found):
        scene = canonical.make(d, other(canonical, params))
        now = canonical.measure(scene, retold(record, d))
        assert {m: why for m, (_, why) in now.items()} == {m: why for m, (_, why) in seen.items()}
        for metric, check in checks.items():
            value, least = seen[metric][0], 1e-6 * (check.bound or 0.0) * factor(check.unit)
            told = None if value is None else pytest.approx(factor(check.unit) * value, rel=1e-9, abs=least)
            assert now[metric][0] == told, check
        if canonical.primary:
            (value, reason), (was, why) = canonical.primary.error(scene, factor("s") * dt, now), errors[k]
            told = None if was is None else pytest.approx(factor(canonical.primary.unit) * was, rel=1e-9)
            assert (value, reason) == (told, why)
