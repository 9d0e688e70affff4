"""A run on Box2D 2.3 as a stand-alone script: the recorded calls of `adapters.box2d.simulation`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.box2d.simulation import Box2DSimulation
from adapters.recording import written
from adapters.scene import HalfSpace, Scene
from adapters.scene.meeting import common_material
from adapters.script import constants, imports, literal, materials, stepped, text

#: Variables of a script, and the calls that return their values.
_NAMES = {
    "world": "b2World",
    "body": "CreateDynamicBody CreateStaticBody CreateKinematicBody",
    "shape": "b2CircleShape b2PolygonShape",
    "": "CreateFixture",
}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with Box2D; see `adapters.engine.Writer`."""
    import Box2D

    from adapters.box2d.listening import Listener

    made, step = written(Box2DSimulation, Box2D, "Box2D", _NAMES, (scene, dt, settings), {Listener: "listener"})
    lines = [*imports(scene, "import Box2D"), *constants(dt, steps)]
    lines += [f"UNITS = {float(settings['units_per_metre'])!r}  # lengths are handed over in 1/UNITS m", "bodies = {}"]
    early = bool(settings["early_restitution"])
    own = materials(scene) if early or common_material(scene) is None else []
    if own:
        kick = tuple(g * settings["units_per_metre"] * dt for g in scene.gravity)
        lines += ["", *own, *_LISTENER]
        lines += [f"    KICK = {literal(kick)}  # gravity of a step", *_EARLY] if early else []
        lines += ["", "", "listener = Listener()"]
    else:
        made.remove("world.contactListener = listener")  # it only reads
    still = literal([body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)])
    lines += ["", *made, "", f"HALF_SPACES = {still}  # their pose is the origin, wherever their polygons stand"]
    return text([*lines, *_STATE, *stepped(step)])


#: Lines of the listener that gives each new pair its own material.
_LISTENER = [
    "class Listener(Box2D.b2ContactListener):",
    "    def BeginContact(self, contact):",
    "        own = material(contact.fixtureA.body.userData, contact.fixtureB.body.userData)",
    "        contact.restitution, contact.friction = own",
]
#: Lines that lower a restitution to rebound with the velocity before a step's gravity.
_EARLY = [
    "",
    "    def PreSolve(self, contact, oldManifold):",
    "        a, b = contact.fixtureA.body, contact.fixtureB.body",
    "        n, p = contact.worldManifold.normal, contact.worldManifold.points[0]",
    "        va, vb = a.GetLinearVelocityFromWorldPoint(p), b.GetLinearVelocityFromWorldPoint(p)",
    "        before = (vb[0] - va[0]) * n[0] + (vb[1] - va[1]) * n[1]",
    "        falls = (b.type == Box2D.b2_dynamicBody) - (a.type == Box2D.b2_dynamicBody)",
    "        after = before + falls * (self.KICK[0] * n[0] + self.KICK[1] * n[1])",
    "        asked, _ = material(a.userData, b.userData)",
    "        contact.restitution = max(0.0, asked * before / after) if after < 0.0 else asked",
]
#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found, per_metre = {}, 1.0 / UNITS",
    "    for name, body in bodies.items():",
    "        (x, y), (vx, vy) = body.position, body.linearVelocity",
    "        pose = (x * per_metre, y * per_metre, body.angle)",
    "        twist = (vx * per_metre, vy * per_metre, body.angularVelocity)",
    "        found[name] = (0.0, 0.0, 0.0) if name in HALF_SPACES else pose, twist",
    "    return found",
]
