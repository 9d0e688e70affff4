"""Adapter of MuJoCo: soft, convex contact; velocity first, then position.

A contact pushes with the force f >= 0 that makes its acceleration ``a = d aref + (1 - d) a0``, where a0 is the
acceleration without the contact, ``aref = -b v - k r`` a spring and damper (``solref``) and 0 < d < 1 the impedance
(``solimp``). This model has no coefficient of restitution and no static friction; `adapters.mujoco.profiles`
approximates them. [MuJoCo documentation: computation, modeling/solver parameters]
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from importlib.metadata import version
from types import MappingProxyType
from typing import Any, final

from adapters.engine import Declared, Engine, EngineError, EngineFacts, Quirk, Scheme, Simulation
from adapters.mujoco.box_on_face import BoxOnFace
from adapters.mujoco.combination import MINVAL
from adapters.mujoco.model import read
from adapters.mujoco.moving import moved
from adapters.mujoco.options import own_kinds
from adapters.mujoco.pairs import contact_law
from adapters.mujoco.pasting import snippet, words
from adapters.mujoco.profiles import BROUGHT, PROFILES, check_settings
from adapters.mujoco.releases import RELEASES
from adapters.mujoco.script import mjcf, python
from adapters.mujoco.shipped import DOC, IMPEDANCE_RANGE, KNOWN_BAD, SMALLEST_FRICTION
from adapters.mujoco.simulation import MujocoSimulation
from adapters.mujoco.spec import moments
from adapters.mujoco.urdf import read as read_urdf
from adapters.needs import Needs
from adapters.receipts import FRICTION_SHARE, IMPULSE_SHARE
from adapters.receipts.probes import (
    LANDING_LEAD,
    LANDING_SPEED,
    MOST_FRICTION,
    REBOUND_SPEED,
    SLIDE_TIME,
    STEPS,
    Case,
    slide,
)
from adapters.scene import Scene
from adapters.settings import Check, checked_step
from adapters.stepping import step_count

#: Phases of a step over which a rebound is declared.
PHASES = 128


@final
class MujocoEngine(Engine):
    """Adapter of MuJoCo."""

    facts = EngineFacts(
        name="mujoco",
        title="MuJoCo",
        package="mujoco-core",
        dimensions=frozenset({3}),
        scheme=Scheme("contacts at the old pose; forces, contacts and friction in one solve; velocity; position", 1),
        customary_dt=1.0 / 500.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned", "matched": "matched"}),
        colour="#d255f8",
        abilities=frozenset({"surface velocity", "moving half-space", "course", "capsule", "cylinder", "hull"}),
        quirks=(
            Quirk(
                "a state that is not finite is reset to the start, with its time, and the run continues",
                "autoreset is disabled; the run then counts as diverged",
                f"{DOC}, option/flag/autoreset",
            ),
            Quirk(
                "warnings go to the console and to MUJOCO_LOG.TXT in the working directory",
                "both are switched off; the certificate has the counters of d.warning",
                f"{DOC}, mjLogConfig",
            ),
            Quirk(
                "a pair has the larger friction of two geoms, and solref by other rules",
                "a single material is set on every geom; otherwise every pair is stated as <contact><pair>",
                f"{DOC}, modeling: contact parameters",
            ),
            Quirk(
                "mass = nan, timestep = 0 and a negative friction compile without an error",
                "every number is checked before it is given to MuJoCo",
                "measured with 4.0.1",
            ),
            Quirk(
                "MjSpec places the centre of mass at the body's own pos in the body's frame if ipos is not given",
                "ipos and iquat are given",
                "measured with 4.0.1",
            ),
            Quirk(
                "after a step, contacts and their forces are those of the step's start",
                "force times dt is the impulse of the last step; gaps are one step older than the pose",
                f"{DOC}, programming/simulation",
            ),
            Quirk(
                "a mocap body has no velocity in contacts",
                "a prescribed body is a free one, 1e15 times heavier than the rest, without gravity or load; "
                "solvers scale tolerances with the mass of all moving bodies, so these are multiplied by the share "
                "of the free ones; it then acts like a mocap body with a known speed",
                f"{DOC}, modeling: mocap bodies; engine_solver.c, mj_solPrimal",
            ),
            Quirk(
                "mesh vertices are stored in single precision",
                "a hull is a mesh, accurate to 6e-8 of its size; a planar polygon is a prism",
                "measured: a cube as a hull slides like the box to 1e-7",
            ),
            Quirk(
                "a plane belongs to a body without a joint, and surfaces have no velocity",
                "a moving half-space is a mocap body; its velocity, as that of a running surface, enters aref of each "
                "contact's rows between mj_step1 and mj_step2",
                f"{DOC}, computation: constraint model; programming/simulation",
            ),
        ),
        known_bad_versions=KNOWN_BAD,
    )
    profiles = PROFILES
    releases = RELEASES
    exports = MappingProxyType({"python": python, "mjcf": mjcf})
    reads = MappingProxyType({".xml": read, ".urdf": read_urdf})

    def version(self) -> str:
        """Version of `mujoco-core` or `mujoco`, whichever is installed."""
        import mujoco

        return str(mujoco.__version__)

    def listed(self) -> str:
        """See `Engine.listed`; of `mujoco` where there is no `mujoco-core`."""
        try:
            return super().listed()
        except ImportError:
            return version("mujoco")

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse impossible and too small inertias, which MuJoCo does not compile."""
        for body in scene.bodies:
            if body.motion == "free":
                a, b, c = sorted(moments(body))
                if min(body.mass, a) < MINVAL:
                    what, least = ("mass", body.mass) if body.mass < MINVAL else ("inertia", a)
                    return f"{body.name}.{what}: {least:g} is less than {MINVAL:g}, the minimum of a moving body"
                if a + b < c * (1.0 - 1e-9):
                    return f"{body.name}.inertia: {a:g} + {b:g} < {c:g}, no mass distribution has these moments"
        return None

    def settable(self) -> Mapping[str, Check]:
        """See `Engine.settable`."""
        return own_kinds()

    def check_settings(self, settings: Mapping[str, Any]) -> None:
        """See `Engine.check_settings`."""
        check_settings(settings)

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world.

        Raises
        ------
        EngineError
            For a scene or a setting that MuJoCo does not support.
        """
        self._check(scene, dt, settings)
        return MujocoSimulation(scene, dt, settings)

    def _check(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        checked_step(dt)
        refusal = self.refuses(scene, "")
        if refusal:
            raise EngineError(refusal)
        check_settings(settings)
        if moved(scene) and settings["integrator"] == "RK4":
            raise EngineError("integrator: RK4 detects contacts within a step, where moving faces have no velocity")

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebound as shipped, over all phases of a step; friction of a box that hops; sums of forces; RK4's fall."""
        settings = {setting.name: setting.value for setting in self.settings(profile, needs, dt)}
        own_laws = "rounds" not in settings  # the matched profile has Newton's and Coulomb's
        declared = {"impulse": _impulses(settings, needs.friction, dt)}
        if settings["integrator"] == "RK4":
            declared |= _second_order_fall()
        elif own_laws and needs.friction > 0.0 and not BROUGHT & set(settings):
            declared |= _friction(settings, needs, dt)
        rebounds = needs.regime == "impact" and needs.friction <= MOST_FRICTION  # above, balls sink through pyramids
        if own_laws and settings["solref"] != "reflect" and rebounds:
            law = contact_law(settings, needs.restitution, needs.friction, dt)
            ratios = [law.rebound_ratio(REBOUND_SPEED, (k + 0.5) / PHASES) for k in range(PHASES)]
            because = "spring and damper with force >= 0: the rebound depends on the phase of the step, not on e"
            declared["restitution"] = Declared.over(ratios, 1e-12, because)
        return declared

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """MJCF: ``<option>``, and the contact parameters of every geom, or of each pair where materials differ."""
        return snippet(settings, names, scene, dt)

    def words(self, settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
        """Attributes of MJCF."""
        return words(settings, scene, dt)


def _impulses(settings: Mapping[str, Any], friction: float, dt: float) -> Declared:
    """Reported impulses over the momentum of the landing probe: forces are solved to a tolerance and to round-off.

    Newton's method stops when a step gains less than ``tolerance`` of its cost, in units of the mean inertia times the
    unknowns, 6 for each of the four bodies. That far from the minimum, the gradient (the difference of forces and
    momentum) is up to ``sqrt(2 H tolerance)``, H being a contact's stiffness m/(1 - d): sqrt(2 * 24 * tolerance / (1 -
    d)) m/s^2 in each step of the probe.

    A force is stiffness times acceleration, and an acceleration of six components has six roundings: for all impulses
    together ``6 epsilon H/m``. H is larger in a pyramid, whose edges have ``d/((1 - d) 2 mu^2)`` of a unit mass each
    (documentation, computation: contact), four of them at each of the box's four corners; at mu = 1e-5, which a pair
    without friction keeps, that is 1.5e12.
    """
    deep = min(float(settings["solimp"][1]), IMPEDANCE_RANGE[1])
    gradient = math.sqrt(2.0 * 24.0 * float(settings["tolerance"]) / (1.0 - deep))
    steps = math.ceil(2.0 * LANDING_LEAD + 1.0)
    band = IMPULSE_SHARE + steps * dt * gradient / LANDING_SPEED
    because = "forces are solved to a tolerance, which bounds the momentum error of each step of the landing"
    if settings["cone"] == "pyramidal" and (friction > 0.0 or settings["smooth_condim"] == 3):
        mu = max(min(friction, MOST_FRICTION), SMALLEST_FRICTION) / math.sqrt(float(settings["impratio"]))
        band += 6.0 * 2.0**-52 * 16.0 * deep / ((1.0 - deep) * 2.0 * mu * mu)
        because += "; and to the round-off of stiff edges of friction pyramids"
    return Declared(1.0, band, because)


def _friction(settings: Mapping[str, Any], needs: Needs, dt: float) -> dict[str, Declared]:
    """Friction over load of the probe's sliding box, by the law of its contacts, where that is not mu.

    Normal and friction are one convex problem: stopping a slip lifts the box. While it slides or flies that does not
    change mu. Above mu = 1 or so the box is thrown up and turned, and lands on an edge, where a pyramid's edges across
    the slip, or a stopping edge, carry load with less friction. Newton's method stops at a tolerance in each step
    (`adapters.mujoco.predictions.solver_error`), whose effect is found from a start with that error.
    """
    case = Case(needs.dimension, needs.restitution, needs.friction, dt, 0.0)
    scene, steps = slide(case), step_count(SLIDE_TIME, dt)
    box, speed = BoxOnFace.of(settings, scene, dt), scene.bodies[1].twist[0]
    off = math.sqrt(12.0 * float(settings["tolerance"])) * dt
    ratios = []
    for k in (0.0, 1.0, -1.0) if off else (0.0,):
        (forwards, upwards, _) = box.motion(steps, speed + k * off)[-1][1]
        ratios.append((speed + k * off - forwards) / (upwards - scene.gravity[-1] * steps * dt))
    if all(abs(ratio - needs.friction) <= FRICTION_SHARE * needs.friction for ratio in ratios):
        return {}  # as asked
    band = FRICTION_SHARE * needs.friction + 2.0 * max(abs(ratio - ratios[0]) for ratio in ratios)
    because = (
        "the contact model is convex: stopping a slip lifts the box; at a landing friction is less than mu "
        "times the load"
    )
    return dict.fromkeys(("friction", "friction_impulse"), Declared(ratios[0], band, because))


def _second_order_fall() -> dict[str, Declared]:
    """Result of the free-fall probe for a scheme whose positions follow ``g t^2/2`` without an offset.

    It compares with velocity-first stepping: positions are half a step early, velocities are not; and the path of
    step n, ``(v_n + v_(n-1))/2 dt``, falls short of ``v_n dt``.
    """
    steps = range(STEPS // 2 + 1, STEPS + 1)
    because = "RK4 falls by g t^2/2, half a step of gravity short of velocity-first stepping"
    path = sum(n - 0.5 for n in steps) / sum(steps)
    return {"step": Declared(path, 1e-12, because), "sampling": Declared(0.25, 0.25 + 1e-12, because)}
