"""Is this adapter one? Checks that need no test framework and name what is wrong.

Each check is a function of an engine that returns the first thing wrong, or "" if nothing is; `CHECKS` maps names to
checks. The parameter receipts of every profile follow as ``receipt <quantity>``. `crosscheck check-adapter` prints
the findings.
"""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import ROLES, Contacts, Engine, EngineError, EngineFacts, Setting, Simulation
from adapters.lift import lift
from adapters.needs import Needs, needs
from adapters.receipts import QUANTITIES, receipts
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene
from adapters.stepping import run
from adapters.trajectory import Sampling

#: Step of the checks [s]: the bench's own.
DT = 1.0 / 240.0
#: Steps of what receipts are measured at [s]: slowest and fastest of the usual range.
RECEIPT_STEPS = (1.0 / 60.0, 1.0 / 240.0)
#: What a start state or a normal may be off: round-off, and the root and product of a quaternion's components.
ROUND_OFF = 1e-9
#: What impulses may miss of a momentum of order 1 [N s]: a solver that stops at a tolerance reports the forces of its
#: last iterate. The root of a tolerance of 1e-8 on its cost is 1e-4 (2e-5 in a step, measured), times ten.
BOOKKEEPING = 1e-3


@dataclass(frozen=True)
class Finding:
    """What one check found."""

    check: str
    holds: bool
    message: str

    def __str__(self) -> str:
        """One line."""
        return f"{'ok  ' if self.holds else 'FAIL'}  {self.check}: {self.message}"


def check_adapter(engine: Engine) -> list[Finding]:
    """Run every check on ``engine``; an exception of the engine's is a finding, never raised."""
    findings = []
    for name, check in CHECKS.items():
        try:
            wrong = check(engine)
        except Exception as error:  # a plugin may raise anything
            wrong = f"{type(error).__name__}: {error}".splitlines()[0]
        meant = (check.__doc__ or "").splitlines()[0].rstrip(".")
        findings.append(Finding(name, not wrong, wrong or meant))
    return findings + _receipt_findings(engine)


# ---- scenes of the checks ----------------------------------------------------------------------------------------


def _resting(order: int = 1, gravity: float = 9.81) -> Scene:
    """A disc falls onto a floor beside a box that stands on it; ``order`` -1 puts the floor last."""
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("ball", Disc(0.5), 2.0, 0.25, (0.0, 0.51, 0.0), (0.0, -1.0, 0.0)),
        Body("box", Box((0.5, 0.25)), 3.0, 0.4, (4.0, 0.25, 0.0)),
    )
    pair = Pair(restitution=0.0, friction=0.5)
    return Scene("check_resting", 1, 2, bodies[::order], (pair,), (0.0, -gravity), 24 * DT)


def _striking(order: int = 1) -> Scene:
    """A ball strikes another one of three times its mass in free space; ``order`` -1 swaps them in the scene."""
    bodies = (
        Body("light", Disc(0.5), 1.0, 0.125, (-0.52, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Body("heavy", Disc(0.5), 3.0, 0.375, (0.52, 0.0, 0.0)),
    )
    return Scene("check_striking", 1, 2, bodies[::order], (Pair(restitution=0.5),), (0.0, 0.0), 48 * DT)


def _scenes(engine: Engine, scene: Scene) -> Iterator[Scene]:
    """The scene in every dimension that the engine can be asked for."""
    yield scene
    if 3 in engine.facts.dimensions:
        yield lift(scene)


def _values(engine: Engine, profile: str, scene: Scene) -> dict[str, Any]:
    return {setting.name: setting.value for setting in engine.settings(profile, needs(scene), DT)}


def _posed(engine: Engine, scene: Scene) -> Scene:
    return scene if scene.dimension in engine.facts.dimensions else lift(scene)


def _built(engine: Engine, scene: Scene, profile: str) -> Simulation:
    return engine.build(_posed(engine, scene), DT, _values(engine, profile, scene))


# ---- checks ------------------------------------------------------------------------------------------------------


def packages(engine: Engine) -> str:
    """The package `adapters` on this path is the one that these checks belong to."""
    spec = importlib.util.find_spec("adapters")
    found = Path(spec.origin).resolve().parent if spec and spec.origin else None
    return "" if found == Path(__file__).resolve().parent else f"`adapters` on this path is {found}"


def facts(engine: Engine) -> str:
    """Facts name the engine, its dimensions, its step order and a customary step."""
    stated = engine.facts
    if not isinstance(stated, EngineFacts) or not stated.name or not stated.package:
        return "facts need a name and the package to install"
    if not stated.dimensions or not stated.dimensions <= {2, 3}:
        return f"facts.dimensions: {set(stated.dimensions)} must be out of 2 and 3"
    for scheme in (stated.scheme, *map(engine.scheme, engine.profiles)):
        if scheme.position_offset not in (-1, 0, 1):
            return f"scheme.position_offset: {scheme.position_offset!r} must be -1, 0 or 1"
    for profile, role in stated.roles.items():
        if profile not in engine.profiles or role not in ROLES:
            return (
                f"facts.roles: {profile!r} cannot be {role!r}: no such profile, or none of the roles {', '.join(ROLES)}"
            )
    if not (math.isfinite(stated.customary_dt) and stated.customary_dt > 0.0):
        return f"facts.customary_dt: {stated.customary_dt!r} must be a positive number of seconds"
    return "" if isinstance(engine.version(), str) and engine.version() else "version() must say which"


def profiles(engine: Engine) -> str:
    """Every profile gives the same settings each time, each with a name and a reason."""
    if not engine.profiles:
        return "there is no profile"
    for profile, asked in product(engine.profiles, _needs(engine)):
        settings = engine.settings(profile, asked, DT)
        names = [setting.name for setting in settings]
        if settings != engine.settings(profile, asked, DT):
            return f"{profile}: differs from call to call"
        for setting in settings:
            if not isinstance(setting, Setting) or not setting.because:
                return f"{profile}: {getattr(setting, 'name', setting)} has no reason"
            if names.count(setting.name) > 1:
                return f"{profile}: {setting.name} is set twice"
            json.dumps(setting.value)
    return ""


def refusals(engine: Engine) -> str:
    """Unknown profiles, unknown settings and bad steps raise EngineError; a refusal is one line."""
    scene, posed = _resting(), _posed(engine, _resting())
    values = _values(engine, next(iter(engine.profiles)), scene)
    attempts: dict[str, Callable[[], Any]] = {
        "an unknown profile": lambda: engine.settings("no such profile", needs(scene), DT),
        "an unknown setting": lambda: engine.build(posed, DT, {**values, "no_such_setting": 1.0}),
        "a step of 0": lambda: engine.build(posed, 0.0, values),
        "a step that is not a number": lambda: engine.build(posed, math.nan, values),
    }
    for what, attempt in attempts.items():
        try:
            attempt()
        except EngineError as error:
            if len(str(error).splitlines()) != 1:
                return f"{what} is refused in more than one line"
        else:
            return f"{what} is accepted"
    for given, profile in product(_scenes(engine, _odd_pairs()), engine.profiles):
        answer = engine.refuses(_posed(engine, given), profile)
        if answer is not None and (not isinstance(answer, str) or len(answer.splitlines()) != 1):
            return f"{profile}: refuses() must give one line or None, not {answer!r}"
    return ""


def _odd_pairs() -> Scene:
    """Pairs whose coefficients are no product of two numbers."""
    bodies = tuple(Body(name, Disc(0.5), pose=(2.0 * k, 0.0, 0.0)) for k, name in enumerate("abc"))
    pairs = (Pair("a", "b", 0.9), Pair("b", "c", 0.5), Pair("a", "c", 0.0))
    return Scene("check_pairs", 1, 2, bodies, pairs, (0.0, 0.0), 1.0)


def states(engine: Engine) -> str:
    """Poses and twists are those of all bodies in the scene's order, and start as the scene says."""
    for profile, order in product(engine.profiles, (1, -1)):
        scene = _posed(engine, _resting(order))
        simulation = _built(engine, _resting(order), profile)
        try:
            pose, twist, changed = simulation.pose(), simulation.twist(), simulation.initial_change
        finally:
            simulation.close()
        asked = np.array([body.pose for body in scene.bodies])
        if pose.shape != asked.shape or twist.shape != (len(scene.bodies), 3 if scene.dimension == 2 else 6):
            return f"{profile}: shapes are {pose.shape} and {twist.shape}"
        if not np.allclose(twist, [body.twist for body in scene.bodies], rtol=0.0, atol=ROUND_OFF):
            return f"{profile}: bodies start with other velocities than the scene's"
        # A start that was changed on purpose is shown beside the result; it must be said.
        if not changed and not np.allclose(pose, asked, rtol=0.0, atol=ROUND_OFF):
            return f"{profile}: bodies start in another pose than the scene's, and initial_change does not say so"
    return ""


def fresh(engine: Engine) -> str:
    """Two worlds stepped in turn give, bit for bit, what each gives alone."""
    for profile in engine.profiles:
        scenes = (_resting(), _resting(-1, 4.0), _striking())
        alone = [_interleaved(engine, profile, [scene])[0] for scene in scenes]
        together = _interleaved(engine, profile, list(scenes))
        for scene, a, b in zip(scenes, alone, together, strict=True):
            if not np.array_equal(a, b):
                return f"{profile}: {scene.name} comes out otherwise when another world is stepped in between"
    return ""


def _interleaved(engine: Engine, profile: str, scenes: list[Scene]) -> list[np.ndarray]:
    """Final states of worlds that are all built first and then stepped in turn."""
    worlds: list[Simulation] = []
    try:
        for scene in scenes:
            worlds.append(_built(engine, scene, profile))
        for _ in range(24):
            for world in worlds:
                world.advance(1)
        return [np.hstack([world.pose(), world.twist()]) for world in worlds]
    finally:
        for world in worlds:
            world.close()


def contacts(engine: Engine) -> str:
    """Contacts say which bodies, with unit normals from the lower to the higher index, where they are."""
    for profile, order in product(engine.profiles, (1, -1)):
        scene = _resting(order)
        for given in _scenes(engine, scene):
            trajectory = run(engine, given, DT, _values(engine, profile, given), Sampling(1, 0.0))
            if trajectory.contacts is None or not len(trajectory.contacts.rows.a):
                return f"{profile}: a body resting on a floor has no contact"
            wrong = _wrong_contact(given, trajectory.contacts.rows)
            if wrong:
                return f"{profile}: {wrong}"
    return ""


def _wrong_contact(scene: Scene, rows: Contacts) -> str:
    floor, up = scene.index("floor"), scene.dimension - 1
    if not (rows.a < rows.b).all():
        return "a contact has its bodies not in order of the scene"
    if not ((rows.a == floor) | (rows.b == floor)).all():
        return "bodies far apart are in contact"
    upwards = np.where(rows.a == floor, rows.normal[:, up], -rows.normal[:, up])
    if np.abs(np.linalg.norm(rows.normal, axis=1) - 1.0).max() > ROUND_OFF:
        return "a normal is not of length 1"
    if upwards.min() < 1.0 - ROUND_OFF:
        return "a normal does not point from the first to the second body"
    # 0.05 m: bodies sink by centimetres at most, and every other place of a body is farther from the floor.
    if np.abs(rows.point[:, up]).max() > 0.05 or np.abs(rows.gap).max() > 0.05:
        return "a contact point or a gap is not where bodies touch"
    pushes = (rows.impulse * rows.normal).sum(axis=1)
    if (pushes < -ROUND_OFF).any():
        return "an impulse pulls: it must act on the second body, along the normal"
    return ""


def impulse(engine: Engine) -> str:
    """Impulses account for the momentum of the body they name: sum J = m dv on b, and -J on a."""
    for profile, order in product(engine.profiles, (1, -1)):
        for scene in _scenes(engine, _striking(order)):
            d = scene.dimension
            trajectory = run(engine, scene, DT, _values(engine, profile, scene), Sampling(1, 0.0))
            assert trajectory.contacts is not None
            total = trajectory.contacts.impulse_between(0, 1).sum(axis=0)
            if np.isnan(total).all():
                continue  # the engine does not tell, and says so
            gained = [
                body.mass * (last - first)[:d]
                for body, first, last in zip(scene.bodies, trajectory.twist[0], trajectory.twist[-1], strict=True)
            ]
            if np.abs(gained[1]).max() < 0.1:
                return f"{profile}: the balls passed through each other"
            # Drag of a profile acts on the momentum too, and not through contacts: 0.2 s at 2 m/s and 8 %/s is 0.03.
            slack = BOOKKEEPING + 0.05 * float("linear_damping" in engine.declares(profile, needs(scene), DT))
            for name, gain, told in (("b", gained[1], total), ("a", gained[0], -total)):
                if np.abs(gain - told).max() > slack:
                    return f"{profile}: body {name} gained {gain} N s, its contacts tell of {told} N s"
    return ""


def readback(engine: Engine) -> str:
    """A simulation tells what the engine now holds, as data that can be stored."""
    for profile in engine.profiles:
        simulation = _built(engine, _resting(), profile)
        try:
            held = simulation.readback()
        finally:
            simulation.close()
        if not held:
            return f"{profile}: nothing is read back"
        json.dumps(held)
    return ""


CHECKS: dict[str, Callable[[Engine], str]] = {
    "packages": packages,
    "facts": facts,
    "profiles": profiles,
    "refusals": refusals,
    "states": states,
    "fresh": fresh,
    "contacts": contacts,
    "impulse": impulse,
    "readback": readback,
}


# ---- receipts ----------------------------------------------------------------------------------------------------


def _needs(engine: Engine) -> Iterator[Needs]:
    """Needs of elastic and plastic impacts, with and without friction, of rest and sliding, in every dimension."""
    base = replace(needs(_striking()), top_speed=6.0, gravity=9.81, restitution=0.8, regime="impact")
    resting = replace(base, friction=0.5, rotation=True, restitution=0.0, regime="rest")
    plastic, rough = replace(base, restitution=0.0), replace(base, restitution=0.5, friction=0.5, slide=True)
    kinds = (base, plastic, rough, resting, replace(resting, slide=True))
    for dimension in (2, 3) if 3 in engine.facts.dimensions else (2,):
        for kind in kinds:
            yield replace(kind, dimension=dimension)


def _receipt_findings(engine: Engine) -> list[Finding]:
    """One finding per quantity: the first receipt of any profile that does not hold, or that all do."""
    broken: dict[str, str] = {}
    refused: dict[str, str] = {}
    for profile, asked, dt in product(engine.profiles, _needs(engine), RECEIPT_STEPS):
        where = f"{profile}, {asked.dimension}-D, {asked.regime}, e {asked.restitution:g}, dt {dt:.5f}"
        try:
            slips = receipts(engine, profile, asked, dt)
        except Exception as error:  # a plugin may raise anything
            broken.setdefault("probes", f"{where}: {type(error).__name__}: {error}".splitlines()[0])
            continue
        for slip in slips:
            if math.isnan(slip.measured):
                refused.setdefault(slip.quantity, slip.because)
            if not slip.holds:
                told = f"measured {slip.measured:.6g}, declared {slip.declared:.6g} +- {slip.band:.2g}"
                broken.setdefault(slip.quantity, f"{where}: {told} ({slip.because})")
    findings = [Finding("receipt probes", False, broken["probes"])] if "probes" in broken else []
    for quantity in QUANTITIES:
        good = refused.get(quantity, "as declared in every profile")
        findings.append(Finding(f"receipt {quantity}", quantity not in broken, broken.get(quantity, good)))
    return findings
