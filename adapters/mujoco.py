"""MuJoCo (`mujoco-core` or `mujoco`, >= 4.0.1): soft, convex contact; velocity first, then position.

A contact pushes with the force f >= 0 that makes its acceleration ``a = d aref + (1 - d) a0``, where a0 is the
acceleration without the contact, ``aref = -b v - k r`` a spring and damper (``solref``) and 0 < d < 1 the
impedance (``solimp``). This model has no coefficient of restitution and no static friction; what the profiles make
of that stands in `default` and `tuned` below. [MuJoCo documentation: computation, modeling/solver parameters]

After a step MuJoCo holds positions and velocities of the step's end, but contacts, gaps and contact forces of its
start. ``force * dt`` is therefore the impulse of the step just made, and `Contacts.gap` is the gap that step began
with: it lags the pose by one step.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import Any, final

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
from adapters.mujoco_law import ContactLaw, softness_of
from adapters.needs import Needs
from adapters.probes import REBOUND_SPEED, STEPS
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere

DOC = "MuJoCo documentation"
SOLVER = f"{DOC}, modeling: solver parameters"
FRICTION = f"{DOC}, modeling: friction, slow slippage"
REFLECT = f"{DOC}, computation/speculative: elastic restitution"

MEASURED = "measured with 4.0.1"
CARRIES = "a load needs a spring of stiffness kappa/dt^2 to rest on"

STOCK_SOLREF = (0.02, 1.0)
STOCK_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
#: Impedance as close to 1 as MuJoCo lets it be (mjMAXIMP), the same at every depth.
RIGID = (0.9999, 0.9999, 0.001, 0.5, 1.0)
#: Phases of a step over which a rebound is declared.
PHASES = 128
#: Stiffness of a resting contact in units of 1/dt^2: with damping 1/dt a depth shrinks by 1 - kappa a step. 0.1 settles
#: in ten steps and stays clear of the limit of 1. 0.5 rests less deep still, but a column of ten at one Newton step
#: explodes with it (`crosscheck tune mujoco --group stand`).
KAPPA = 0.1
#: Mass of a prescribed body over the largest free mass: a blow changes its velocity by 1e-12 of the free body's,
#: the round-off that every check allows.
PRESCRIBED_MASS = 1e12


def default(needs: Needs, dt: float) -> list[Setting]:
    """As shipped, whatever the scene needs; friction is given to both geoms of a pair."""
    shipped = "as shipped"
    return [
        Setting("integrator", "Euler", shipped, DOC),
        Setting("cone", "pyramidal", shipped, DOC),
        Setting("impratio", 1.0, shipped, DOC),
        Setting("iterations", 100, f"{shipped}: at most so many Newton steps", DOC),
        Setting("tolerance", 1e-8, shipped, DOC),
        Setting("noslip_iterations", 0, shipped, DOC),
        Setting("smooth_condim", 3, f"{shipped}: a pair with mu = 0 keeps friction rows, of mu = 1e-5", DOC),
        Setting("solref", STOCK_SOLREF, f"{shipped}: time constant [s] and damping ratio; e has no say", SOLVER),
        Setting("solimp", STOCK_SOLIMP, shipped, SOLVER),
        Setting("solreffriction", None, f"{shipped}: friction is damped like the normal", FRICTION),
        Setting("margin", 0.0, f"{shipped} [m]: contact starts when bodies overlap", DOC),
    ]


def tuned(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for the scene's needs."""
    if needs.regime == "free":
        return _replaced(default(needs, dt), Setting("integrator", "RK4", "nothing can touch: fourth order", DOC))
    settings = _replaced(
        default(needs, dt),
        Setting("cone", "elliptic", "the pyramid is an L1 cone: mu/sqrt(2) at 45 degrees", f"{DOC}, computation"),
        Setting("smooth_condim", 1, "a pair with mu = 0 has no friction rows", f"{DOC}, computation: contact"),
        Setting("solref", "reflect", "asks for velocity -e v one step after contact: damping (1 + e)/dt", REFLECT),
        Setting("solimp", RIGID, "d = 0.9999: only the 1e-4 that is left of the load gets through", SOLVER),
        Setting("tolerance", 0.0, "Newton goes on to round-off: forces add up too, at no cost", MEASURED),
        Setting("kappa_elastic", 0.0, "a stiffness kappa/dt^2 would add kappa times the phase to e", MEASURED),
        Setting("kappa_plastic", 0.0, "without a load there is nothing to carry", SOLVER),
    )
    if needs.regime == "rest":
        settings = _replaced(settings, *_resting(needs, dt))
    elif needs.gravity > 0.0 and needs.restitution > 0.0:
        settings = _replaced(settings, Setting("kappa_plastic", KAPPA, CARRIES, SOLVER))
    if needs.friction > 0.0 and needs.restitution > 0.0:
        reverses = "the normal's damping (1 + e)/dt would reverse the slip: 1/dt stops it"
        settings = _replaced(settings, Setting("solreffriction", "stick", reverses, FRICTION))
    return settings


def _resting(needs: Needs, dt: float) -> list[Setting]:
    """What changes for bodies that only rest, stick and slide (e = 0 everywhere)."""
    settings = [Setting("kappa_plastic", KAPPA, CARRIES, SOLVER)]
    depth = (1.0 - RIGID[0]) / KAPPA * needs.gravity * dt**2
    touches = "the depth (1-d)/kappa g dt^2 at which a body rests: touching bodies then start and stay in contact"
    settings.append(Setting("margin", depth, touches, f"{SOLVER}; {DOC}, margin"))
    if needs.friction > 0.0:
        creeps = "stick is viscous, creep (1-d)/(d b n impratio) g sin(theta): 100 puts it far below g dt^2/s"
        settings.append(Setting("impratio", 100.0, creeps, FRICTION))
    if needs.slide:
        # Stiff friction damping throws a sliding body up, soft damping stops it late. Over 25 inclines with
        # tan(theta)/mu in 1.001 ... 2 at dt = 1/240 s, median error of the acceleration: 0.01 s 17 %, 0.02 s 9 %,
        # 0.05 s 5 %, 0.1 s 3 %, 0.2 s 8 %; error of the stopping distance from 1 m/s: 0.05 s -0.8 %, 0.1 s +4 %.
        # Creep is below 1e-7 m/s for all of them. noslip changes creep only; pyramids creep at 4e-4 m/s near the
        # edge of the cone; softer normals (d = 0.9, 0.5) slide no better, and d = 0.1 rattles.
        best = "least error over tan(theta)/mu = 0.5 ... 2 and in stopping distance: 0.01 s hops, 0.1 s stops late"
        settings.append(Setting("solreffriction", (0.05, 1.0), best, MEASURED))
    return settings


def _replaced(settings: list[Setting], *changes: Setting) -> list[Setting]:
    """Settings with those of the same name replaced, others appended."""
    new = {setting.name: setting for setting in (*settings, *changes)}
    return list(new.values())


#: Settings whose value is one of these words.
WORDS = {
    "integrator": ("Euler", "RK4", "implicit", "implicitfast"),
    "cone": ("pyramidal", "elliptic"),
    "smooth_condim": (1, 3),
}
#: Settings that are one number: smallest value, and whether it must be whole.
NUMBERS = {
    "impratio": (1e-6, False),
    "iterations": (1, True),
    "tolerance": (0.0, False),
    "margin": (0.0, False),
    "noslip_iterations": (0, True),
    "kappa_elastic": (0.0, False),
    "kappa_plastic": (0.0, False),
}
NAMES = frozenset({*WORDS, *NUMBERS, "solref", "solimp", "solreffriction"})
ONLY_REFLECT = frozenset({"kappa_elastic", "kappa_plastic"})


def check_settings(settings: Mapping[str, Any]) -> None:
    """Refuse settings that are unknown, missing or out of range; MuJoCo itself accepts most of them in silence.

    Raises
    ------
    EngineError
        Naming the setting.
    """
    wanted = NAMES if settings.get("solref") == "reflect" else NAMES - ONLY_REFLECT
    for name in sorted(set(settings) ^ wanted):
        raise EngineError(f"{name}: {'mujoco has no such setting here' if name in settings else 'is missing'}")
    for name, words in WORDS.items():
        if settings[name] not in words:
            raise EngineError(f"{name}: {settings[name]!r} must be one of {', '.join(map(str, words))}")
    for name, (low, whole) in NUMBERS.items():
        if name in settings:
            _check_number(name, settings[name], low, whole)
    _check_row("solimp", settings["solimp"], 5)
    if settings["solref"] != "reflect":
        _check_row("solref", settings["solref"], 2)
    if settings["solreffriction"] not in (None, "stick"):
        _check_row("solreffriction", settings["solreffriction"], 2)
        if settings["cone"] != "elliptic":
            raise EngineError("solreffriction: acts on elliptic cones only")


def _check_number(name: str, value: Any, low: float, whole: bool) -> None:
    number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and value >= low):
        raise EngineError(f"{name}: {value!r} must be a {'whole ' if whole else ''}number of at least {low:g}")


def _check_row(name: str, values: Any, length: int) -> None:
    if not (isinstance(values, tuple | list) and len(values) == length):
        raise EngineError(f"{name}: {values!r} must have {length} numbers")
    for value in values:
        _check_number(name, value, 0.0, False)


def pair_solref(settings: Mapping[str, Any], restitution: float, dt: float) -> tuple[float, float]:
    """``solref`` of a pair; "reflect" asks for the velocity -e v one step after contact, v' = v - dt (1+e)/dt v."""
    if settings["solref"] != "reflect":
        return (settings["solref"][0], settings["solref"][1])
    kappa = settings["kappa_elastic" if restitution > 0.0 else "kappa_plastic"]
    return (-kappa / dt**2, -(1.0 + restitution) / dt)


def pair_solreffriction(settings: Mapping[str, Any], dt: float) -> tuple[float, float]:
    """``solreffriction`` of a pair; "stick" asks friction to stop the slip within the step, v' = v - dt/dt v."""
    value = settings["solreffriction"]
    if value is None:
        return (0.0, 0.0)  # MuJoCo's own way of saying: as solref
    return (0.0, -1.0 / dt) if value == "stick" else (value[0], value[1])


def contact_law(settings: Mapping[str, Any], restitution: float, friction: float, dt: float) -> ContactLaw:
    """Scalar law that a contact of this pair follows under ``settings``."""
    condim = 3 if friction > 0.0 else settings["smooth_condim"]
    softness = softness_of(settings["cone"], condim, friction)
    solref = pair_solref(settings, restitution, dt)
    return ContactLaw.of(dt, solref, tuple(settings["solimp"]), softness, settings["margin"])


@final
class MujocoEngine(Engine):
    """MuJoCo behind the plugin line."""

    facts = EngineFacts(
        name="mujoco",
        title="MuJoCo",
        package="mujoco-core",
        dimensions=frozenset({3}),
        scheme=Scheme("contacts at the old pose; forces, contacts and friction in one solve; velocity; position", 1),
        customary_dt=1.0 / 500.0,
        quirks=(
            Quirk(
                "a state that is not finite is reset to the start, time included, and stepping goes on",
                "autoreset is disabled, the state stays not finite and the run counts as diverged",
                f"{DOC}, option/flag/autoreset",
            ),
            Quirk(
                "warnings go to the console and to MUJOCO_LOG.TXT in the working directory",
                "both are switched off; the counters of d.warning stand in the certificate",
                f"{DOC}, mjLogConfig",
            ),
            Quirk(
                "geoms combine friction by the larger of the two, and solref by rules of their own",
                "one material for all: set on every geom; else every pair is stated as <contact><pair>",
                f"{DOC}, modeling: contact parameters",
            ),
            Quirk(
                "mass = nan, timestep = 0 and a negative friction compile without an error",
                "every number is checked before MuJoCo sees it",
                "measured with 4.0.1",
            ),
            Quirk(
                "MjSpec places the centre of mass at the body's own pos in the body's frame if ipos is not given",
                "ipos and iquat are given",
                "measured with 4.0.1",
            ),
            Quirk(
                "after a step, contacts and their forces belong to the step's start",
                "force times dt is the impulse of the step just made; gaps lag the pose by one step",
                f"{DOC}, programming/simulation",
            ),
            Quirk(
                "a mocap body has no velocity in contacts",
                "a prescribed body is a free one, 1e12 times heavier than the rest, without gravity or load",
                f"{DOC}, modeling: mocap bodies",
            ),
        ),
        known_bad_versions={"4.0.0": "wrong sparse Newton factor: wrong accelerations, divergence (fixed in 4.0.1)"},
    )
    profiles = MappingProxyType({"default": default, "tuned": tuned})

    def version(self) -> str:
        """Version of `mujoco-core` or `mujoco`, whichever is installed."""
        import mujoco

        return str(mujoco.__version__)

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse inertias that no mass distribution has: MuJoCo does not compile them."""
        for body in scene.bodies:
            if body.motion == "free":
                a, b, c = sorted(_moments(body))
                if a + b < c * (1.0 - 1e-9):
                    return f"{body.name}.inertia: {a:g} + {b:g} < {c:g}, no mass distribution has these moments"
        return None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world.

        Raises
        ------
        EngineError
            For a scene or a setting that MuJoCo cannot honour.
        """
        if not (math.isfinite(dt) and dt > 0.0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        refusal = self.refuses(scene, "")
        if refusal:
            raise EngineError(refusal)
        check_settings(settings)
        return MujocoSimulation(scene, dt, settings)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebound of the spring and damper as shipped, over all phases of a step; RK4's second-order fall."""
        settings = {setting.name: setting.value for setting in self.settings(profile, needs, dt)}
        declared: dict[str, Declared] = {}
        if settings["integrator"] == "RK4":
            declared |= _second_order_fall()
        if settings["solref"] != "reflect" and needs.regime == "impact":
            law = contact_law(settings, needs.restitution, needs.friction, dt)
            ratios = [law.rebound_ratio(REBOUND_SPEED, (k + 0.5) / PHASES) for k in range(PHASES)]
            middle, half = 0.5 * (max(ratios) + min(ratios)), 0.5 * (max(ratios) - min(ratios))
            because = "spring and damper with force >= 0: the phase of the step decides, e has no say"
            # Between two of the phases the rebound changes by no more than between them and their neighbours.
            steepest = max(abs(x - y) for x, y in pairwise(ratios))
            declared["restitution"] = Declared(middle, half + steepest + 1e-12, because)
        return declared

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """MJCF: ``<option>``, and the contact parameters on every geom (on a pair where only a pair has them)."""
        material = next(material for _, _, material in scene.contact_pairs())
        option = {name: settings[name] for name in _OPTIONS if name in names}
        contact: dict[str, Any] = {}
        if {"solref", "kappa_elastic", "kappa_plastic"} & set(names):
            contact["solref"] = pair_solref(settings, material.restitution, dt)
        if "solimp" in names:
            contact["solimp"] = settings["solimp"]
        if "smooth_condim" in names and material.friction == 0.0:
            contact["condim"] = settings["smooth_condim"]
        paired = "solreffriction" in names
        if "margin" in names:
            contact["margin"] = settings["margin"] * (1.0 if paired else 0.5)  # a pair's is the sum of its geoms'
        if paired:
            contact["solreffriction"] = pair_solreffriction(settings, dt)
        lines = [_element("option", {"timestep": dt, **option})]
        if contact and paired:
            lines.append(f"<contact>{_element('pair', {'geom1': 'A', 'geom2': 'B', **contact})}</contact>")
        elif contact:
            lines.append(f"<default>{_element('geom', contact)}</default>")
        return "\n".join(lines)


#: Settings that are attributes of MJCF's ``<option>``, by the same name.
_OPTIONS = ("integrator", "cone", "impratio", "iterations", "tolerance", "noslip_iterations")


def _element(name: str, attributes: Mapping[str, Any]) -> str:
    """One empty MJCF element; numbers keep all digits that matter to a step."""

    def text(value: Any) -> str:
        if isinstance(value, tuple | list):
            return " ".join(text(item) for item in value)
        return f"{value:.9g}" if isinstance(value, float) else str(value)

    return f"<{name} " + " ".join(f'{key}="{text(value)}"' for key, value in attributes.items()) + "/>"


def _second_order_fall() -> dict[str, Declared]:
    """What the free-fall probe sees of a scheme whose positions follow ``g t^2/2`` without an offset.

    It compares with velocity-first stepping: positions are half a step early, velocities are not; and the path of
    step n, ``(v_n + v_(n-1))/2 dt``, falls short of ``v_n dt``.
    """
    steps = range(STEPS // 2 + 1, STEPS + 1)
    because = "RK4 falls by g t^2/2, half a step of gravity short of velocity-first stepping"
    path = sum(n - 0.5 for n in steps) / sum(steps)
    return {"step": Declared(path, 1e-12, because), "sampling": Declared(0.25, 0.25 + 1e-12, because)}


def _moments(body: Body) -> tuple[float, float, float]:
    assert isinstance(body.inertia, tuple), "MuJoCo is spatial: planar scenes arrive lifted"
    return body.inertia


def _rotation(quaternion: Array) -> Array:
    """Matrices (n, 3, 3) of unit quaternions (n, 4)."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _turn_z_to(normal: tuple[float, ...]) -> list[float]:
    """Unit quaternion of the shortest turn from +z to ``normal``."""
    x, y, z = normal
    if z < -1.0 + 1e-12:
        return [0.0, 1.0, 0.0, 0.0]
    w = math.sqrt(0.5 * (1.0 + z))
    return [w, -0.5 * y / w, 0.5 * x / w, 0.0]


class _Spec:
    """Writes a scene as an `MjSpec`: bodies, then either one material on all geoms or one entry per pair."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        import mujoco

        self.mujoco, self.scene, self.dt, self.settings = mujoco, scene, dt, settings
        self.spec = mujoco.MjSpec()
        pairs = list(scene.contact_pairs())
        materials = {(material.restitution, material.friction) for _, _, material in pairs}
        self.shared = materials.pop() if len(materials) == 1 and settings["solreffriction"] is None else None
        self._options()
        free = [body for body in scene.bodies if body.motion == "free"]
        self.heavy = PRESCRIBED_MASS * max((b.mass for b in free), default=1.0)
        self.heavy_moment = PRESCRIBED_MASS * max((max(_moments(b)) for b in free), default=1.0)
        for index, body in enumerate(scene.bodies):
            self._body(index, body)
        if self.shared is None:
            for a, b, material in pairs:
                self._pair(a, b, material.restitution, material.friction)

    def _options(self) -> None:
        mj, option, settings = self.mujoco, self.spec.option, self.settings
        option.timestep = self.dt
        option.gravity = self.scene.gravity
        option.integrator = getattr(mj.mjtIntegrator, f"mjINT_{settings['integrator'].upper()}")
        option.cone = getattr(mj.mjtCone, f"mjCONE_{settings['cone'].upper()}")
        for name in ("impratio", "iterations", "tolerance", "noslip_iterations"):
            setattr(option, name, settings[name])
        option.disableflags = mj.mjtDisableBit.mjDSBL_AUTORESET

    def _body(self, index: int, body: Body) -> None:
        world = self.spec.worldbody
        half_space = isinstance(body.shape, HalfSpace)
        made = world if half_space else world.add_body(name=f"body{index}", pos=body.pose[:3], quat=body.pose[3:])
        if body.motion != "fixed":
            made.add_freejoint()
            made.explicitinertial = True
            made.ipos, made.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)  # undefined ones become pos and quat
            free = body.motion == "free"
            made.mass = body.mass if free else self.heavy
            made.inertia = _moments(body) if free else (self.heavy_moment,) * 3
            made.gravcomp = 0.0 if free else 1.0
        # Two geoms meet if one's contype has a bit of the other's conaffinity: only free bodies have one.
        filtered = {"contype": 0, "conaffinity": 0}
        if self.shared is not None:
            filtered = {"contype": 1, "conaffinity": int(body.motion == "free")} | self._geom_material()
        made.add_geom(name=f"geom{index}", **self._shape(body), **filtered)

    def _shape(self, body: Body) -> dict[str, Any]:
        kinds, shape = self.mujoco.mjtGeom, body.shape
        if isinstance(shape, Sphere):
            return {"type": kinds.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0]}
        if isinstance(shape, Box):
            return {"type": kinds.mjGEOM_BOX, "size": list(shape.half_extents)}
        assert isinstance(shape, HalfSpace)
        foot = [shape.offset * n for n in shape.normal]
        plane = {"type": kinds.mjGEOM_PLANE, "size": [0.0, 0.0, 1.0]}  # 0: without end, and exact
        return plane | {"pos": foot, "quat": _turn_z_to(shape.normal)}

    def _condim(self, friction: float) -> int:
        return 3 if friction > 0.0 else int(self.settings["smooth_condim"])

    def _geom_material(self) -> dict[str, Any]:
        assert self.shared is not None
        restitution, friction = self.shared
        return {
            "friction": [friction, 0.0, 0.0],
            "condim": self._condim(friction),
            "solref": pair_solref(self.settings, restitution, self.dt),
            "solimp": self.settings["solimp"],
            "margin": 0.5 * self.settings["margin"],  # a pair's margin is the sum of its geoms'
        }

    def _pair(self, a: int, b: int, restitution: float, friction: float) -> None:
        if all(isinstance(self.scene.bodies[i].shape, HalfSpace) for i in (a, b)):
            return
        self.spec.add_pair(
            name=f"pair{a}-{b}",
            geomname1=f"geom{a}",
            geomname2=f"geom{b}",
            condim=self._condim(friction),
            friction=[friction, friction, 0.0, 0.0, 0.0],
            solref=pair_solref(self.settings, restitution, self.dt),
            solreffriction=pair_solreffriction(self.settings, self.dt),
            solimp=self.settings["solimp"],
            margin=self.settings["margin"],
        )

    def compile(self) -> Any:
        """Model; MuJoCo's complaint becomes one line."""
        try:
            model = self.spec.compile()
        except ValueError as error:
            raise EngineError(f"scene: MuJoCo does not compile it: {' '.join(str(error).split())}") from None
        if any(body.motion == "prescribed" for body in self.scene.bodies):
            # The solver stops by the mean inertia; one that counts a prescribed body would stop it at once.
            free = [b for b in self.scene.bodies if b.motion == "free"]
            inertias = [x for b in free for x in (*(b.mass,) * 3, *_moments(b))]
            model.stat.meaninertia = sum(inertias) / max(1, len(inertias)) or 1.0
        return model


@final
class MujocoSimulation(Simulation):
    """One MuJoCo model and its data."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        import mujoco

        log = mujoco.MjLogConfig.get()
        log.logto_file = log.logto_console = False
        log.set()
        self._mujoco, self._scene, self._dt = mujoco, scene, dt
        self._settings = dict(settings)
        self._model = _Spec(scene, dt, settings).compile()
        self._data = mujoco.MjData(self._model)
        self._moving = [i for i, body in enumerate(scene.bodies) if body.motion != "fixed"]
        self._poses = np.array([body.pose for body in scene.bodies], dtype=float)
        self._twists = np.zeros((len(scene.bodies), 6))
        names = [self._model.geom(g).name for g in range(self._model.ngeom)]
        self._body_of_geom = [int(name.removeprefix("geom")) for name in names]
        self._set_start()

    def _set_start(self) -> None:
        """Start state and loads; MuJoCo keeps angular velocity in body axes."""
        for slot, index in enumerate(self._moving):
            body = self._scene.bodies[index]
            turn = _rotation(np.array([body.pose[3:]]))[0]
            self._data.qpos[7 * slot : 7 * slot + 7] = body.pose
            self._data.qvel[6 * slot : 6 * slot + 6] = (*body.twist[:3], *(turn.T @ np.array(body.twist[3:])))
            if body.motion == "free":
                row = self._model.body(f"body{index}").id
                self._data.xfrc_applied[row] = (*body.force, *body.torque)

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps.

        Raises
        ------
        EngineError
            If MuJoCo dropped contacts for want of memory.
        """
        self._mujoco.mj_step(self._model, self._data, nstep=steps)
        kinds = self._mujoco.mjtWarning
        for kind in (kinds.mjWARN_CONTACTFULL, kinds.mjWARN_CNSTRFULL):
            if self._data.warning[kind].number:
                raise EngineError("memory: MuJoCo's arena is too small, it dropped contacts")

    def pose(self) -> Array:
        """Poses at the end of the last step."""
        if self._moving:
            self._poses[self._moving] = self._data.qpos.reshape(-1, 7)
        return self._poses.copy()

    def twist(self) -> Array:
        """Twists at the end of the last step."""
        if self._moving:
            velocity = self._data.qvel.reshape(-1, 6)
            turns = _rotation(self._data.qpos.reshape(-1, 7)[:, 3:])
            self._twists[self._moving, :3] = velocity[:, :3]
            self._twists[self._moving, 3:] = np.einsum("nij,nj->ni", turns, velocity[:, 3:])
        return self._twists.copy()

    def contacts(self) -> Contacts:
        """Contacts and gaps at the start of the last step, impulses of that step.

        RK4 solves contacts four times a step and keeps the last: its impulses are not available (NaN).
        """
        one_solve = self._settings["integrator"] != "RK4"
        force, rows = np.zeros(6), []
        for k in range(self._data.ncon):
            contact = self._data.contact[k]
            frame = contact.frame.reshape(3, 3)
            self._mujoco.mj_contactForce(self._model, self._data, k, force)
            impulse = self._dt * (force[:3] @ frame) if one_solve else np.full(3, np.nan)
            a, b = (self._body_of_geom[g] for g in contact.geom)
            rows.append((a, b, contact.pos.copy(), frame[0].copy(), impulse, float(contact.dist)))
        return Contacts.from_rows(rows, 3)

    def readback(self) -> dict[str, Any]:
        """What the compiled model holds."""
        model, mj = self._model, self._mujoco
        option = model.opt
        values: dict[str, Any] = {
            "dt": float(option.timestep),
            "gravity": option.gravity.tolist(),
            "integrator": mj.mjtIntegrator(option.integrator).name,
            "cone": mj.mjtCone(option.cone).name,
            "solver": mj.mjtSolver(option.solver).name,
            "iterations": int(option.iterations),
            "tolerance": float(option.tolerance),
            "noslip_iterations": int(option.noslip_iterations),
            "impratio": float(option.impratio),
            "disableflags": int(option.disableflags),
            "enableflags": int(option.enableflags),
            "materials": self._materials(),
        }
        for index in self._moving:
            row, name = model.body(f"body{index}"), self._scene.bodies[index].name
            values[f"{name}.mass"] = float(row.mass[0])
            values[f"{name}.inertia"] = row.inertia.tolist()
            values[f"{name}.size"] = model.geom(f"geom{index}").size.tolist()
        return values

    def _materials(self) -> dict[str, Any]:
        model = self._model
        if model.npair == 0:
            row = model.geom(0)
            fields = {"friction": row.friction, "solref": row.solref, "solimp": row.solimp, "condim": row.condim}
            return {"all geoms": {name: np.ravel(value).tolist() for name, value in fields.items()}}
        return {
            model.pair(k).name: {
                "friction": float(model.pair_friction[k][0]),
                "condim": int(model.pair_dim[k]),
                "solref": model.pair_solref[k].tolist(),
                "solreffriction": model.pair_solreffriction[k].tolist(),
                "solimp": model.pair_solimp[k].tolist(),
            }
            for k in range(model.npair)
        }

    def certificate(self) -> dict[str, Any]:
        """Largest residual of M a = loads + contacts in the last solve [N, N m], Newton steps, warnings."""
        mj, model, data = self._mujoco, self._model, self._data
        if model.nv == 0:
            return {}
        inertial = np.zeros(model.nv)
        mj.mj_mulM(model, data, inertial, data.qacc)
        residual = np.abs(inertial - data.qfrc_smooth - data.qfrc_constraint).max()
        warnings = {mj.mju_warningText(k, 0): int(w.number) for k, w in enumerate(data.warning) if w.number}
        return {"residual": float(residual), "newton_steps": data.solver_niter.tolist(), "warnings": warnings}
