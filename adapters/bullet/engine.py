"""The adapter of Bullet: facts, refusals, and declarations of its profiles.

Source references are to bulletphysics/bullet3 at 6c888f4, the commit of the 3.2.7 wheels.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

from adapters.bullet.contact_law import ContactLaw, drag_share, loss_in_one_second, rebound_range
from adapters.bullet.profiles import BODY, KINDS, PROFILES, SOFT, WORLD, law_of
from adapters.bullet.releases import RELEASES
from adapters.bullet.script import python
from adapters.bullet.shipped import LARGEST_FRICTION, SMALLEST_INERTIA, SMALLEST_SIZE, WARM_STARTING
from adapters.bullet.simulation import BulletSimulation
from adapters.bullet.translation import factors, moments
from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineError, EngineFacts, Quirk, Scheme
from adapters.needs import Needs, needs
from adapters.receipts import FRICTION_SHARE
from adapters.receipts.probes import (
    MOST_FRICTION,
    REBOUND_LEAD,
    REBOUND_RADIUS,
    REBOUND_SPEED,
    REBOUND_TIME,
    SLIDE_TIME,
    slide_load,
    slide_speed,
)
from adapters.scene import HalfSpace, Scene
from adapters.scene.meeting import meeting_pairs
from adapters.scene.shapes import ROUND
from adapters.settings import checked

_QUIRKS = (
    Quirk(
        "coefficients of two bodies multiply",
        "values per body are computed from the pairs; a table that is no product is refused",
        "btManifoldResult.cpp:58,70",
    ),
    Quirk(
        "a plane gives a box one contact point a step, which makes it spin",
        "a half-space is a thick static box, in every profile",
        "btConvexPlaneCollisionAlgorithm.cpp:92; bullet3 #1514",
    ),
    Quirk(
        "a new inertia or orientation acts a step late, and setting an inertia without a mass deletes the mass of a "
        "rigid body",
        "bodies wait far away, already turned, for one step without gravity; mass and inertia are set together",
        "measured: a touching disc rolls at 5/7 instead of 2/3, a turned body answers a torque by its unturned inertia",
    ),
    Quirk(
        "contactBreakingThreshold is a C global that outlives a connection",
        "every profile sets it",
        "PhysicsServerCommandProcessor.cpp:11525",
    ),
    Quirk(
        "negative and NaN values are ignored without an error",
        "all numbers are checked before they are set, and read back",
        "pybullet.c:1825",
    ),
    Quirk(
        "contacts beyond contactProcessingThreshold still report their last impulse",
        "their impulse counts as zero",
        "measured: an impulse sum six times too large after one rebound",
    ),
    Quirk(
        "getDynamicsInfo does not fill in restitution and damping of rigid bodies, and returns those of earlier calls",
        "not read back on that path; property checks measure them",
        "measured: 0.7 asked, 0.0 or an older body's value reported",
    ),
    Quirk(
        "contact distances are those before the step, forces those of the step",
        "stated in the contact record; states are read after the step",
        "PhysicsServerCommandProcessor.cpp:8663",
    ),
    Quirk(
        "hulls have a margin of 1 mm; their manifolds, and those of capsules and cylinders, get one point a step",
        "unchanged: a hull rests 1 mm high, a cylinder that lands on its end turns (0.3 rad/s at 1 m/s and e = "
        "0.5), a rolling one ends 3 to 4 % too fast",
        "measured with 3.2.7; btConvexConvexAlgorithm.cpp, btConvexHullShape's collision margin",
    ),
    Quirk(
        "faces are clipped for bodies from URDF files only, and hull vertices are truncated to 1/10216 of the extents",
        "with `enableSAT` boxes and hulls come from files, with vertices as stated; a hull may hover by such a cell",
        "btConvexHullComputer.cpp; measured: whole cells, in tests/adapters/test_bullet.py",
    ),
    Quirk("external loads last for one step", "applied again before every step", "PyBullet Quickstart Guide"),
    Quirk(
        "there is no kinematic body in Python and rigid static bodies ignore a velocity",
        "a prescribed body is a free one of 1e15 times the heaviest mass, whose velocity is set before every step",
        "measured: recoil within round-off",
    ),
)


class BulletEngine(CheckedEngine):
    """Bullet 3 through PyBullet."""

    facts = EngineFacts(
        name="bullet",
        title="Bullet 3 (PyBullet)",
        package="pybullet",
        dimensions=frozenset({3}),
        scheme=Scheme("contacts at the old pose -> velocity (forces, then impulses) -> position", +1),
        customary_dt=1.0 / 240.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned", "one": "one"}),
        abilities=frozenset({"moving half-space", "course", "capsule", "cylinder", "hull", "restitution above 1"}),
        colour="#12a38d",
        quirks=_QUIRKS,
    )
    module = "pybullet"
    simulation = BulletSimulation
    profiles = PROFILES
    kinds = KINDS
    releases = RELEASES
    exports = MappingProxyType({"python": python})

    def version(self) -> str:
        """Version of the installed wheel; PyBullet itself has no version, and prints a line at import."""
        return version("pybullet")

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse sizes and moments beyond Bullet's range, too much friction, and unfactorable materials."""
        for body in scene.bodies:
            if body.shape.smallest_size < SMALLEST_SIZE:
                return f"{body.name}.shape: bullet needs sizes of at least {SMALLEST_SIZE:g} m"
            if body.motion == "free" and min(body.mass, *moments(body, body.mass)) < SMALLEST_INERTIA:
                return f"{body.name}: bullet needs masses and moments of at least {SMALLEST_INERTIA:g}"
        if any(pair.friction > LARGEST_FRICTION for pair in scene.pairs) and any(
            material.friction > LARGEST_FRICTION for _, _, material in meeting_pairs(scene)
        ):
            return f"friction: bullet clamps coefficients to {LARGEST_FRICTION:g}"
        for coefficient in ("restitution", "friction"):
            if factors(scene, coefficient) is None:
                return f"{coefficient}: bullet multiplies values of bodies, and this table of pairs is no such product"
        return None

    def checked(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """See `CheckedEngine.checked`; what is not set is as shipped."""
        if len(SOFT & set(settings)) == 1:
            raise EngineError("contactStiffness: bullet takes it together with contactDamping only")
        return checked(self.name, self.kinds, settings, optional=self.kinds)

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: parameters of the world, of how bodies are made, and of each body; none depends on the step."""
        lines = []
        world = [f"{_WORDS.get(n, n)}={settings[n]!r}" for n in names if n in WORLD | {"iterations"}]
        if world:
            lines.append(f"p.setPhysicsEngineParameter({', '.join(world)})  # of the whole world")
        if "useMaximalCoordinates" in names:
            lines.append(
                f"p.createMultiBody(..., useMaximalCoordinates={settings['useMaximalCoordinates']})  # each body"
            )
        if settings.get("enableSAT") and "enableSAT" in names:
            lines.append("p.loadURDF(..., flags=p.URDF_INITIALIZE_SAT_FEATURES)  # each box and hull")
        soft = [f"{n}={settings[n]!r}" for n in names if n in SOFT]
        body = [f"{n}={settings[n]!r}" for n in names if n in BODY - SOFT]
        if body:
            lines.append(f"p.changeDynamics(body, -1, {', '.join(body)})  # each body")
        if soft:
            which = "rebound" if needs(scene).restitution > 0.0 else "need it"
            lines.append(f"p.changeDynamics(body, -1, {', '.join(soft)})  # only bodies that {which}")
        flat = any(isinstance(body.shape, HalfSpace) for body in scene.bodies)
        boxes = any(not isinstance(body.shape, (HalfSpace, *ROUND)) for body in scene.bodies)
        floor = "; the floor a box, as plane.urdf: on GEOM_PLANE boxes spin" if flat and boxes else ""
        return "\n".join([f"# p: pybullet{floor}", *lines]) if lines else ""

    def words(self, settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
        """Parameters of pybullet."""
        return {name: (word, settings[name]) for name, word in _WORDS.items() if name in settings}

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Drag and rebounds of the multibody path as shipped; the too fast rebounds of `one`; friction of all."""
        law = law_of(profile, needs, dt)
        declared = _sliding(profile, law, needs, dt) if 0.0 < needs.friction <= MOST_FRICTION else {}
        if profile == "one":
            declared["restitution"] = _gain(law, needs.restitution, dt)
        if profile != "default":
            return declared
        # 1e-12: round-off of up to a thousand steps.
        loss = Declared(loss_in_one_second(law, dt), 1e-12, "drag of a multibody, 0.04 (1 + v) v, for spin as well")
        time = (REBOUND_LEAD + 4) * dt + REBOUND_TIME
        ball = (REBOUND_RADIUS, REBOUND_SPEED, needs.restitution, dt, REBOUND_LEAD, time)
        least, greatest = rebound_range(law, *ball)
        because = (
            "speculative contact subtracts gap/dt from a rebound, depending on the phase of the step: "
            "recurrence over all phases"
        )
        rebound = Declared(0.5 * (least + greatest), 0.5 * (greatest - least), because)
        return {**declared, "linear_damping": loss, "angular_damping": loss, "restitution": rebound}


#: Settings with another name in pybullet.
_WORDS = {"iterations": "numSolverIterations"}


def _sliding(profile: str, law: ContactLaw, needs: Needs, dt: float) -> dict[str, Declared]:
    """Friction of the sliding probe: Coulomb's, and as shipped the drag of the multibody path on top.

    A contact point that appears or disappears under a fast box has friction in a step without load; a slide has one at
    each end at most, and more where the box hops (`_hopping`). On the rigid-body path that adds friction and never
    reduces it (measured at 1/60 .. 1/960 s).
    """
    friction, share = needs.friction, dt / SLIDE_TIME
    because = "contact points under a fast box come and go: at each end of the slide a step may lack its load"
    if profile != "default":
        held = WARM_STARTING * _hopping(law, friction, needs.restitution, dt)
        if held:
            because = (
                "a box that hops within the slop loads its points in turns: a point without load keeps its friction"
            )
            share += 0.5 * held
        more = Declared(friction * (1.0 + share), friction * (share + FRICTION_SHARE), because)
        return {"friction": more, "friction_impulse": more}
    slowed = drag_share(law, slide_speed(friction), friction * slide_load(friction), dt, SLIDE_TIME)
    drag = f"{because}; and drag 0.04 (1 + v) v, by its recurrence"
    return {
        # The probe measures the whole deceleration over the load: drag counts in a step without load as well.
        "friction": Declared(friction * (1.0 + slowed), 2.0 * share * friction * (1.0 + slowed), drag),
        "friction_impulse": Declared(friction, 2.0 * share * friction, because),
    }


#: Slop from which a hopping box may unload a point, in falls of a step: half of the slop at which it must.
UNLOADS = 0.25


def _hopping(law: ContactLaw, friction: float, e: float, dt: float) -> float:
    """Share of the sliding probe's steps in which the box may hop instead of rest on its floor.

    A box sinks by the slop in a step, ``q g dt^2``, and with restitution rises by it in the next, because both ends of
    the hop are contacts; the step down carries 1 - 2 q of the weight, the step up 1 + 2 q. From q = 1/2 on a step
    carries nothing, and a point with less load loses it earlier (measured from 0.45 on, at 1/240 and 1/960 s): the
    limit here is half of that. Each hop is slower by e, from g dt/2 down to the threshold of restitution. Without warm
    starting, without slop or with a higher threshold the friction is exact.
    """
    load = slide_load(friction)
    hop = 0.5 * load * dt
    if e == 0.0 or law.slop < UNLOADS * load * dt**2 or hop <= law.threshold:
        return 0.0
    hops = math.inf if e >= 1.0 else math.log(hop / law.threshold) / -math.log(e)
    return min(1.0, 2.0 * hops * dt / SLIDE_TIME)


def _gain(law: ContactLaw, e: float, dt: float) -> Declared:
    """An impact is found 0 .. v dt deep: Baumgarte adds up to erp v, and an impact within the slop loses slop/dt."""
    lost = law.slop / (REBOUND_SPEED * dt)
    because = (
        "found 0 .. v dt deep; a share contactERP of that per step becomes speed; within the slop, slop/dt is lost"
    )
    return Declared(e + 0.5 * (law.erp - lost), 0.5 * (law.erp + lost), because)
