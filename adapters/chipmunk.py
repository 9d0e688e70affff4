"""Chipmunk (Munk2D) through pymunk: planar, impulse-based, fixed sweeps.

    step:  x += (v + v_bias) dt  ->  detect  ->  bounce = e v.n (before forces)  ->  v += (g + f/m) dt
           ->  warm start  ->  N sweeps over the contacts (accumulated clamping, friction with the current total)

Position is advanced first, with the old velocity, so pose, contacts and impulses read after a step belong to the
same instant, and free fall lags the parabola by g t dt / 2. Line numbers below are those of Munk2D's ``src/``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from adapters.engine import (
    Array,
    Contacts,
    Declared,
    Engine,
    EngineError,
    EngineFacts,
    Quirk,
    Scheme,
    Setting,
    Simulation,
)
from adapters.needs import Needs, needs
from adapters.scene import Body, Box, Disc, HalfSpace, Scene

#: A half-space is one thick static polygon. Nothing is swept, so what sinks deeper than half the depth in one step
#: leaves on the wrong side: 1 km is safe to 1e5 m/s at 1/240 s. Results do not depend on either number (the
#: ten-box column is bit-identical for depths 10 m .. 10 km and half widths 1 km .. 10 km).
GROUND_DEPTH = 1e3
GROUND_HALF_WIDTH = 1e4
#: Faces closer than this share of the smallest body count as touching when the resting overlap is applied: a
#: thousandth of the tuned slop, so what it may misjudge is far below what the overlap itself changes.
TOUCHING = 1e-6
#: Product of two factors may miss a pair's coefficient by the rounding of logarithms, exponentials and a product
#: (relative; 7e-15, well below the 1e-12 that any check asks of a single contact).
FACTOR_ROUNDING = 32.0 * np.finfo(float).eps

SETTING_NAMES = ("iterations", "collision_slop", "collision_bias", "collision_persistence", "start_overlap")


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: what ``pymunk.Space()`` holds (the odd digits are single-precision literals in its source)."""
    shipped, source = "as shipped", "cpSpace.c, cpSpaceInit"
    return [
        Setting("iterations", 10, shipped, source),
        Setting("collision_slop", 0.10000000149011612, shipped, source),
        Setting("collision_bias", 0.0017970074436457143, f"{shipped}: 0.9 to the 60th per second", source),
        Setting("collision_persistence", 3, shipped, source),
        Setting("start_overlap", 0.0, "the scene starts as posed", ""),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    slop, resting = 1e-3 * needs.smallest_size, needs.regime == "rest"
    heavy = needs.mass_ratio >= 100.0
    return [
        Setting(
            "iterations",
            100 if heavy else 30,
            "sweeps grow with the mass ratio: 30 lets a column carrying 100 times its mass fall at 1/60 s, 100 holds"
            if heavy
            else "brings a flat landing to 1e-8 and a column of ten to rest; error shrinks with every sweep",
            "measured: flat box against sweeps, columns",
        ),
        Setting(
            "collision_slop",
            slop,
            "a thousandth of the smallest body: the shipped 0.1 m is a tenth of it, 0 makes contacts flicker",
            "cpArbiter.c, cpArbiterPreStep",
        ),
        Setting(
            "collision_bias",
            0.0017970074436457143 if resting else 1.0,
            "as shipped: resting bodies need the push-out"
            if resting
            else "1 switches the push-out off, which would add potential energy to every impact found late",
            "cpSpaceStep.c; measured: a ball with e = 1 then keeps its energy to 2e-15 over 100 s",
        ),
        Setting(
            "collision_persistence",
            1,
            "the shipped 3 revives old impulses when a contact re-forms, so that contacts can pull",
            "cpArbiter.c, cpArbiterUpdate and cpArbiterApplyCachedImpulse",
        ),
        Setting(
            "start_overlap",
            _start_overlap(needs, slop, dt) if resting else 0.0,
            "touching pairs start 0.3 g dt^2 deep, inside the slop that is never corrected: an exactly touching start "
            "flickers by g dt^2 and costs a transient"
            if resting
            else "bodies that hit must not start inside each other: a shock would pass an overlapping chain at once",
            "crosscheck tune chipmunk --group stand: half the slop was deeper than needed and no steadier",
        ),
    ]


def _start_overlap(needs: Needs, slop: float, dt: float) -> float:
    """Depth at which touching bodies start [m]: a share of g dt^2, and at most half the slop."""
    fall = needs.gravity * dt * dt
    return min(0.5 * slop, 0.3 * fall) if fall > 0.0 else 0.5 * slop


class ChipmunkEngine(Engine):
    """Planar engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="chipmunk",
        title="Chipmunk 2D (Munk2D) through pymunk",
        package="pymunk",
        dimensions=frozenset({2}),
        scheme=Scheme("position, detect, sample restitution, forces, solve", -1),
        customary_dt=1.0 / 60.0,
        quirks=(
            Quirk("external forces are cleared by every step", "they are set again before each", "cpBody.c:502"),
            Quirk(
                "restitution and friction of a pair are products of the two shapes' numbers",
                "factors are chosen whose products are the pairs' values; a table without such factors is refused",
                "cpArbiter.c:334-335",
            ),
            Quirk(
                "one arbiter holds up to two points, but only their summed impulse is public",
                "the impulse of each point is read from the arbiter's structure; their sum is the public total",
                "cpArbiter.h:30",
            ),
            Quirk("Body.kinetic_energy is twice the energy", "energies are computed from twists", "cpBody.c:588"),
            Quirk(
                "mass, moment, elasticity, friction or iterations out of range abort the process",
                "every number is checked before it is handed over",
                "cpBody.c:258, cpShape.c:141, cpSpace.c:208",
            ),
            Quirk(
                "collision_persistence = 0 drops every contact before the solver",
                "refused as a setting",
                "cpSpaceStep.c:344",
            ),
            Quirk(
                "with the shipped persistence of 3, a contact that re-forms within three steps keeps its old "
                "accumulated impulse although it is not applied: totals over-report and contacts can pull",
                "left alone in `default`, persistence 1 in `tuned`",
                "cpArbiter.c:324 and :390",
            ),
            Quirk("the threaded solver gives a different answer each run", "it is not used", "cpHastySpace.c:594"),
            Quirk(
                "a shape query between a circle and a polygon flips the sign of the depth",
                "only its magnitude is used, where the resting overlap looks for touching pairs",
                "measured on pymunk 7.3.1",
            ),
            Quirk("nothing is swept: a fast body passes a thin one", "the ground is 1 km thick", "cpSpaceStep.c:400"),
        ),
    )
    profiles = MappingProxyType({"default": default_profile, "tuned": tuned_profile})

    def version(self) -> str:
        """Version of pymunk; the string of the bundled C library is stale and says nothing."""
        import pymunk

        return str(pymunk.version)

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Pair tables that no product of two numbers can represent, and masses whose inverse overflows."""
        for body in scene.bodies:
            if body.motion == "free" and not math.isfinite(1.0 / body.mass + 1.0 / _moment(body)):
                return f"{body.name}.mass: the inverse of mass or inertia overflows, the engine's state would be NaN"
        for quantity in ("restitution", "friction"):
            if factors(scene, quantity) is None:
                return f"pairs: {quantity} of a pair is a product of two factors here, this table has none"
        return None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; see `Engine.build`.

        Raises
        ------
        EngineError
            For a spatial scene, a scene that `refuses` names, a bad step or setting, or a scene that could leave
            the ground's polygon.
        """
        if scene.dimension != 2:
            raise EngineError("dimension: chipmunk is planar and cannot run a spatial scene")
        if not (math.isfinite(dt) and dt > 0.0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        checked = _checked(settings)
        reason = self.refuses(scene, "") or _leaves_ground(scene, dt)
        if reason:
            raise EngineError(reason)
        return ChipmunkSimulation(scene, dt, checked)

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: attributes of the space."""
        lines = [f"# space: your pymunk.Space, stepped with space.step({dt:.9g})"]
        lines += [f"space.{name} = {settings[name]!r}" for name in names if name != "start_overlap"]
        if "start_overlap" in names and settings["start_overlap"]:
            lines.append(f"# and let touching bodies start {settings['start_overlap']:.4g} m deep in each other")
        return "\n".join(lines)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Nothing: single contacts and constant forces are exact here, in both profiles."""
        return {}


def factors(scene: Scene, quantity: str) -> list[float] | None:
    """One number per body whose products are the pairs' ``quantity``, or None if there are none.

    The immovable partner takes 1 wherever that works, so that a value is handed over exactly; otherwise factors
    solve ``log f_i + log f_j = log value`` over all pairs (a root of the value if it is common to all).
    """
    pairs = [(i, j, float(getattr(material, quantity))) for i, j, material in scene.contact_pairs()]
    n = len(scene.bodies)
    to_immovable = [1.0] * n
    for i, j, value in pairs:
        for body, partner in ((i, j), (j, i)):
            if scene.bodies[body].motion == "free" and scene.bodies[partner].motion != "free":
                to_immovable[body] = value
    for candidate in (to_immovable, _factors_by_logarithm(n, pairs)):
        if all(abs(candidate[i] * candidate[j] - value) <= FACTOR_ROUNDING * value for i, j, value in pairs):
            return candidate
    return None


def _factors_by_logarithm(n: int, pairs: list[tuple[int, int, float]]) -> list[float]:
    """Least-squares factors of the positive pairs; a body without a positive pair gets 0."""
    positive = [(i, j, value) for i, j, value in pairs if value > 0.0]
    if len({value for _, _, value in positive}) == 1:
        root = math.sqrt(positive[0][2])
        used = {k for i, j, _ in positive for k in (i, j)}
        return [root if k in used else 0.0 for k in range(n)]
    rows = np.zeros((len(positive), n))
    for row, (i, j, _) in enumerate(positive):
        rows[row, [i, j]] = 1.0
    logs = np.linalg.lstsq(rows, np.log([value for _, _, value in positive]), rcond=None)[0]
    return [float(np.exp(logs[k])) if rows[:, k].any() else 0.0 for k in range(n)]


def _moment(body: Body) -> float:
    """Planar inertia [kg m^2]; scenes are validated, so a free planar body has one number."""
    assert isinstance(body.inertia, float | int)
    return float(body.inertia)


def _checked(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings whose names and numbers the engine can take; a bad number would abort the process."""
    for name in settings:
        if name not in SETTING_NAMES:
            raise EngineError(f"{name}: chipmunk has no such setting, it has {', '.join(SETTING_NAMES)}")
    for name in SETTING_NAMES:
        if name not in settings:
            raise EngineError(f"{name}: this setting is missing")
    for name in ("iterations", "collision_persistence"):
        value = settings[name]
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value < 2**31:
            raise EngineError(f"{name}: {value!r} must be a whole number from 1 to 2147483647")
    for name, high in (("collision_slop", math.inf), ("collision_bias", 1.0), ("start_overlap", math.inf)):
        value = settings[name]
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not number or not 0.0 <= value <= high:
            limit = " and at most 1" if high == 1.0 else ""
            raise EngineError(f"{name}: {value!r} must be a finite number, at least 0{limit}")
    if settings["start_overlap"] > settings["collision_slop"]:
        raise EngineError("start_overlap: must not exceed collision_slop, it would be pushed out again")
    return dict(settings)


def _leaves_ground(scene: Scene, dt: float) -> str | None:
    """Why the ground's polygon is too small for ``scene``, or None."""
    if not any(isinstance(body.shape, HalfSpace) for body in scene.bodies):
        return None
    speed = needs(scene).top_speed
    if speed * dt > 0.5 * GROUND_DEPTH:
        return f"dt: at {speed:.3g} m/s a body passes {0.5 * GROUND_DEPTH:g} m of ground in one step unseen"
    return None


class ChipmunkSimulation(Simulation):
    """One ``pymunk.Space``; bodies in the scene's order."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        import pymunk

        self.scene, self.dt = scene, dt
        self.space = pymunk.Space(threaded=False)
        gx, gy = scene.gravity
        self.space.gravity = (gx, gy)
        self.space.iterations = settings["iterations"]
        self.space.collision_slop = settings["collision_slop"]
        self.space.collision_bias = settings["collision_bias"]
        self.space.collision_persistence = settings["collision_persistence"]
        self.bodies = [_body(body) for body in scene.bodies]
        self.shapes = [_shape(a.shape, b, 0.0) for a, b in zip(scene.bodies, self.bodies, strict=True)]
        self._set_materials()
        if settings["start_overlap"] > 0.0:
            self._overlap_start(settings["start_overlap"])
        for body, shape in zip(self.bodies, self.shapes, strict=True):
            self.space.add(body, shape)
        self.index = {id(shape): i for i, shape in enumerate(self.shapes)}
        self.loaded = [
            (self.bodies[i], body.force, body.torque[0])
            for i, body in enumerate(scene.bodies)
            if body.motion == "free" and (any(body.force) or any(body.torque))
        ]

    def _set_materials(self) -> None:
        for quantity, attribute in (("restitution", "elasticity"), ("friction", "friction")):
            chosen = factors(self.scene, quantity)
            if chosen is None:
                raise EngineError(f"pairs: no product of two factors represents the {quantity} of this scene")
            for shape, value in zip(self.shapes, chosen, strict=True):
                setattr(shape, attribute, value)

    def _overlap_start(self, overlap: float) -> None:
        """Move free bodies so that every touching pair overlaps by ``overlap``, where that is possible."""
        touching = touching_pairs(self.scene)
        shift = overlap_displacement(self.scene, touching, overlap)
        if shift is None:
            self.initial_change = (
                "none: no displacement lets all touching pairs overlap by "
                f"{overlap:.3g} m, so the scene starts touching as posed",
            )
            return
        if not touching:
            return
        for body, moved in zip(self.bodies, shift, strict=True):
            if moved.any():
                body.position = (body.position.x + moved[0], body.position.y + moved[1])
        self.initial_change = (
            f"{len(touching)} touching pairs start {overlap:.3g} m deep instead of touching; "
            f"the largest displacement is {np.linalg.norm(shift, axis=1).max():.3g} m",
        )

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        step, dt = self.space.step, self.dt
        for _ in range(steps):
            for body, force, torque in self.loaded:
                body.force, body.torque = force, torque
            step(dt)

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return np.array([(*body.position, body.angle) for body in self.bodies], float)

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return np.array([(*body.velocity, body.angular_velocity) for body in self.bodies], float)

    def contacts(self) -> Contacts:
        """Up to two points per pair, sorted by pair; impulses per point."""
        rows: list[tuple[int, int, Any, Any, Any, float]] = []
        failures: list[Exception] = []
        for i, body in enumerate(self.bodies):
            if self.scene.bodies[i].motion != "free":
                continue

            def collect(arbiter: Any, i: int = i) -> None:
                try:  # pymunk prints and swallows what a callback raises
                    j = self.index[id(arbiter.shapes[1])]
                    if i < j or self.scene.bodies[j].motion != "free":
                        rows.extend(_contact_rows(arbiter, i, j))
                except Exception as error:
                    failures.append(error)

            body.each_arbiter(collect)
        if failures:
            raise EngineError(f"contacts: {type(failures[0]).__name__}: {failures[0]}")
        rows.sort(key=lambda row: (min(row[:2]), max(row[:2])))
        return Contacts.from_rows(rows, 2)

    def readback(self) -> dict[str, Any]:
        """What the space, its bodies and shapes hold."""
        space = self.space
        return {
            "dt": self.dt,
            "gravity": list(space.gravity),
            "iterations": space.iterations,
            "collision_slop": space.collision_slop,
            "collision_bias": space.collision_bias,
            "collision_persistence": space.collision_persistence,
            "damping": space.damping,
            "sleep_time_threshold": str(space.sleep_time_threshold),
            "last_step": space.current_time_step,
            "bodies": {
                asked.name: {"mass": body.mass, "inertia": body.moment, "size": _size(shape)}
                for asked, body, shape in zip(self.scene.bodies, self.bodies, self.shapes, strict=True)
                if asked.motion == "free"
            },
            "pairs": {
                f"{self.scene.bodies[i].name}-{self.scene.bodies[j].name}": {
                    "restitution": self.shapes[i].elasticity * self.shapes[j].elasticity,
                    "friction": self.shapes[i].friction * self.shapes[j].friction,
                }
                for i, j, _ in self.scene.contact_pairs()
            },
        }


def _body(asked: Body) -> Any:
    import pymunk

    if asked.motion == "free":
        body = pymunk.Body(asked.mass, _moment(asked))
    else:
        kind = pymunk.Body.STATIC if asked.motion == "fixed" else pymunk.Body.KINEMATIC
        body = pymunk.Body(body_type=kind)
    x, y, theta = asked.pose
    body.position, body.angle = (x, y), theta
    if asked.motion != "fixed":
        vx, vy, omega = asked.twist
        body.velocity, body.angular_velocity = (vx, vy), omega
    return body


def _shape(shape: Any, body: Any, skin: float) -> Any:
    """Shape grown by ``skin`` [m] on all sides."""
    import pymunk

    if isinstance(shape, Disc):
        return pymunk.Circle(body, shape.radius + skin)
    if isinstance(shape, Box):
        hx, hy = shape.half_extents
        return pymunk.Poly(body, [(-hx, -hy), (hx, -hy), (hx, hy), (-hx, hy)], radius=skin)
    assert isinstance(shape, HalfSpace)
    return pymunk.Poly(body, _ground(shape), radius=skin)


def _ground(shape: HalfSpace) -> list[tuple[float, float]]:
    """Corners of a thick slab whose upper face is the half-space's."""
    nx, ny = shape.normal
    corners = []
    for along, depth in ((-1.0, GROUND_DEPTH), (-1.0, 0.0), (1.0, 0.0), (1.0, GROUND_DEPTH)):
        height, side = shape.offset - depth, along * GROUND_HALF_WIDTH
        corners.append((height * nx + side * ny, height * ny - side * nx))
    return corners


def _size(shape: Any) -> list[float]:
    """Radius, or half extents, as the engine holds them [m]."""
    if hasattr(shape, "get_vertices"):
        return [float(x) for x in np.max(np.abs(shape.get_vertices()), axis=0)]
    return [float(shape.radius)]


def _contact_rows(arbiter: Any, i: int, j: int) -> list[tuple[int, int, Any, Any, Any, float]]:
    """Rows of one arbiter seen from body ``i``.

    Impulse on the second body: ``J = n jn + t jt`` with t the normal turned by +90 degrees (cpArbiter.c,
    cpArbiterTotalImpulse), for each point; the accumulated values are not public, pymunk's own pickling reads them
    the same way.
    """
    points = arbiter.contact_point_set
    (nx, ny), rows = points.normal, []
    for point, accumulated in zip(points.points, arbiter._arbiter.contacts[0 : len(points.points)], strict=True):
        jn, jt = accumulated.jnAcc, accumulated.jtAcc
        middle = (0.5 * (point.point_a.x + point.point_b.x), 0.5 * (point.point_a.y + point.point_b.y))
        rows.append((i, j, middle, (nx, ny), (nx * jn - ny * jt, ny * jn + nx * jt), point.distance))
    return rows


def touching_pairs(scene: Scene) -> list[tuple[int, int, Array, float]]:
    """Pairs in touch or overlap at the start: ``(i, j, normal from i to j, gap)``, by the engine's own detection.

    All shapes are grown by a skin, so that touching pairs overlap whatever the rounding; the skin is taken off the
    reported depth again.
    """
    import pymunk

    skin = TOUCHING * needs(scene).smallest_size
    space = pymunk.Space()
    shapes = []
    for asked in scene.bodies:
        body = _body(asked)
        shapes.append(_shape(asked.shape, body, 0.5 * skin))
        space.add(body, shapes[-1])
    found = []
    index = {id(shape): i for i, shape in enumerate(shapes)}
    for i, shape in enumerate(shapes):
        for hit in space.shape_query(shape):
            j = index[id(hit.shape)]
            if i < j and "free" in (scene.bodies[i].motion, scene.bodies[j].motion):
                depth = max(abs(point.distance) for point in hit.contact_point_set.points)
                found.append((i, j, np.array(hit.contact_point_set.normal, float), skin - depth))
    return sorted(found, key=lambda pair: pair[:2])


def overlap_displacement(scene: Scene, touching: list[tuple[int, int, Array, float]], overlap: float) -> Array | None:
    """Smallest translation of each free body after which touching pairs overlap by ``overlap``, (n, 2) [m].

    One equation per pair, ``n . (d_j - d_i) = -overlap - gap``; pairs that the scene itself poses deeper keep their
    depth (right-hand side 0). A column sinks by one overlap more at each interface, a box on an incline moves along
    the floor's normal. None if the equations contradict each other (a box that exactly fits between two walls).
    """
    if not touching:
        return np.zeros((len(scene.bodies), 2))
    rows, goal = np.zeros((len(touching), 2 * len(scene.bodies))), np.zeros(len(touching))
    for row, (i, j, normal, gap) in enumerate(touching):
        for body, sign in ((i, -1.0), (j, 1.0)):
            if scene.bodies[body].motion == "free":
                rows[row, 2 * body : 2 * body + 2] = sign * normal
        goal[row] = -overlap - gap if gap > -overlap else 0.0
    shift = np.linalg.lstsq(rows, goal, rcond=None)[0]
    # A thousandth of the overlap: an order below the accuracy asked of the overlap, far above round-off.
    if np.abs(rows @ shift - goal).max() > 1e-3 * overlap:
        return None
    return np.asarray(shift.reshape(-1, 2))
