r"""Three stones form an arch: a keystone between two springers on the floor, which only friction holds together.

      ______________        the faces of the keystone are smooth, each leans out by beta:
     |   \      /   |       N = W/(2 sin(beta))    on each face,    W: weight of the keystone
     |    \_ W_/    |       thrust  N cos(beta),   floor  R W + W/2   under a springer, R: its mass over the keystone's
     |    /    \    |
     |   |      |   |       stands    if  mu >= cot(beta)/(2 R + 1)
    ==================      else      out by  A = g (k - mu R)/(R + k cot(beta)),  k = (cot(beta) - mu)/2,
      <- A    v   A ->                down by  A cot(beta),  N = m (g - A cot(beta))/(2 sin(beta))

The shape of the stones turns a weight into a thrust several times as large: with an unconverged solver the keystone is
a little too heavy for its springers. All forces are determined, and none is only vertical.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Body, Pair, Polygon, Scene, SceneError
from adapters.scene.shapes import area_and_centroid
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import floor, mass_of, standard_gravity, upward
from validation.truths import leaning

#: Height of the springers and of the keystone, flush on top; width of a springer on the floor, and half of the
#: keystone's lower side [m]. Below the keystone the springers stand straight.
TALL, KEY, BASE, NARROW = 1.5, 0.5, 1.5, 0.25
#: Sinking of the keystone until the run ends [m]: it stays well above the floor and on the faces.
SINKS = 0.2
#: Duration of a run in which it stands [s].
DURATION = 2.0
#: The springers by name, their bodies, and the direction of each.
SPRINGERS = (("left", 1, -1.0), ("right", 2, 1.0))


def _beta(p: Params) -> float:
    """Angle of the keystone's faces to the vertical [rad]."""
    return math.radians(p["beta"])


def needed(p: Params) -> float:
    """Friction of the floor that just holds the springers."""
    return 1.0 / (math.tan(_beta(p)) * (2.0 * p["heavy"] + 1.0))


def motion(p: Params) -> tuple[float, float]:
    """Acceleration of the springers, outwards [m/s^2], and load on a face of the keystone over its weight."""
    s, cot = math.sin(_beta(p)), 1.0 / math.tan(_beta(p))
    if p["ratio"] >= 1.0:
        return 0.0, 0.5 / s
    mu = p["ratio"] * needed(p)
    k = 0.5 * (cot - mu)
    out = p["g"] * (k - mu * p["heavy"]) / (p["heavy"] + k * cot)
    return out, (1.0 - out * cot / p["g"]) * 0.5 / s


def _stones(p: Params) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Corners of the right springer and of the keystone, counter-clockwise, as they stand [m]."""
    wide = NARROW + KEY * math.tan(_beta(p))
    below = TALL - KEY
    springer = ((NARROW, 0.0), (NARROW + BASE, 0.0), (NARROW + BASE, TALL), (wide, TALL), (NARROW, below))
    return springer, ((-NARROW, below), (NARROW, below), (wide, TALL), (-wide, TALL))


def _held(p: Params) -> bool:
    """Whether the floor's force acts within the base of a springer, wherever on its face the keystone pushes.

    With d'Alembert's force at the centre of an accelerating springer; the load acts between the ends of the face.
    """
    out, load = motion(p)
    s, c = math.sin(_beta(p)), math.cos(_beta(p))
    heavy = p["heavy"]
    _, (x, y), _ = area_and_centroid(_stones(p)[0])
    for up in (0.0, KEY):
        across = NARROW + up * math.tan(_beta(p))
        turning = load * c * (TALL - KEY + up) + load * s * across + heavy * (x - out / p["g"] * y)
        if not NARROW < turning / (heavy + load * s) < NARROW + BASE:
            return False
    return True


def _stone(name: str, corners: tuple[tuple[float, float], ...], mass: float) -> Body:
    """A uniform stone with these corners."""
    area, (x, y), second = area_and_centroid(corners)
    shape = Polygon(tuple((a - x, b - y) for a, b in corners))
    return Body(name, shape, mass, mass * second / area, (x, y, 0.0))


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the middle of the keystone stands over the origin.

    Raises
    ------
    SceneError
        If a springer would tip.
    """
    p = params
    if not _held(p):
        raise SceneError(
            f"arch.beta: at {p['beta']:g} degrees springers of {p['heavy']:g} times the keystone's mass tip"
        )
    springer, keystone = _stones(p)
    mirrored = tuple((-x, y) for x, y in reversed(springer))
    bodies = (
        floor(dimension),
        _stone("left", mirrored, p["heavy"] * p["mass"]),
        _stone("right", springer, p["heavy"] * p["mass"]),
        _stone("keystone", keystone, p["mass"]),
    )
    grip = p["ratio"] * needed(p)
    pairs = (Pair(restitution=0.0, friction=grip), Pair("keystone", "*", 0.0, 0.0))
    out, _ = motion(p)
    duration = math.sqrt(2.0 * SINKS * math.tan(_beta(p)) / out) if out > 0.0 else DURATION
    return Scene("arch", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's laws of three stones, at rest or in motion."""
    p = scene.params
    out, load = motion(p)
    loads = {f"face_load[{name}]": load for name, _, _ in SPRINGERS}
    if out == 0.0:
        return {"moved": 0.0} | loads | {f"floor_load[{name}]": p["heavy"] + 0.5 for name, _, _ in SPRINGERS}
    pace = {f"parting[{name}]": out for name, _, _ in SPRINGERS}
    return pace | {"sinking": out / math.tan(_beta(p))} | loads | {"off_the_faces": 0.0, "turned": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Accelerations and loads over the second half, largest displacement of a stone, gaps, overlaps and rotations."""
    p, t, pose, twist = scene.params, trajectory.t, trajectory.pose, trajectory.twist
    s, c = math.sin(_beta(p)), math.cos(_beta(p))
    weight, late = p["mass"] * p["g"] * trajectory.dt, 0.5 * scene.duration
    found: dict[str, Measured] = {"sinking": metrics.mean_rate(t, -twist[:, 3, 1])}
    off = []
    for name, k, way in SPRINGERS:
        found[f"parting[{name}]"] = metrics.mean_rate(t, way * twist[:, k, 0])
        gap = (pose[:, 3, :2] - pose[:, k, :2]) @ np.array([-way * c, s])
        off += [np.abs(gap - gap[0]).max(), np.abs(pose[:, k, 1] - pose[0, k, 1]).max()]
        # On the keystone, the last of the bodies: level towards the middle, and up.
        pushed, floored = (metrics.late_impulses(trajectory, *pair, late) for pair in ((k, 3), (0, k)))
        found[f"face_load[{name}]"] = (
            (None, metrics.UNAVAILABLE) if pushed is None else (float((pushed @ [-way * c, s]).mean()) / weight, "")
        )
        found[f"floor_load[{name}]"] = (
            (None, metrics.UNAVAILABLE) if floored is None else (float(floored[:, 1].mean()) / weight, "")
        )
    swing = metrics.largest(metrics.turned(pose[:, k]) * metrics.reach(scene.bodies[k].shape) for k in (1, 2, 3))
    return found | {
        "moved": (metrics.largest(leaning.way(scene, trajectory, k) for k in (1, 2, 3)), ""),
        "off_the_faces": (metrics.largest(off), ""),
        "turned": (swing, ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Constant forces are exact at every step; floor and faces may each be found one step late at the start.

    Loads are as exact as the speeds that they cause: those of the faces carry the keystone's weight, and their
    difference moves it sideways.
    """
    p, g = scene.params, scene.params["g"]
    late = 2.0 * g * dt * dt + bounds.ROUND_OFF * TALL
    because = "floor and faces, each found up to one step late: g dt^2 each"
    pace = bounds.driven(g, dt, 0.5 * scene.duration)
    told = 2.0 * pace.value / g  # of speeds before and after
    pushed = bounds.Bound(
        0.5 * told * (1.0 / math.sin(_beta(p)) + 1.0 / math.cos(_beta(p))),
        f"{pace.because}, before and after, of the keystone, up and level",
    )
    source = "Newton's laws of keystone and springers"
    found = [pushed.check(name, "weights", truth[name], source) for name in truth if name.startswith("face_load")]
    if "moved" in truth:
        moved = bounds.Bound(2.0 * late, because + "; and a corner sinks or slips as far")
        carried = bounds.Bound((p["heavy"] + 0.5) * told, f"{pace.because}, before and after, of its load")
        found += [carried.check(name, "weights", truth[name], source) for name in truth if name.startswith("floor")]
        return [moved.check("moved", "m", truth["moved"], "Coulomb's law: the floor holds the springers"), *found]
    # The keystone moves down by cot(beta) times the motion of a springer, and so does the tolerance.
    sinking = bounds.Bound(pace.value * max(1.0, 1.0 / math.tan(_beta(p))), f"{pace.because}, of a springer")
    return [
        *(pace.check(f"parting[{name}]", "m/s^2", truth[f"parting[{name}]"], source) for name, _, _ in SPRINGERS),
        sinking.check("sinking", "m/s^2", truth["sinking"], source),
        *found,
        bounds.Bound(late, because).check("off_the_faces", "m", truth["off_the_faces"], "all contacts press"),
        bounds.Bound(late, because).check("turned", "m", truth["turned"], "flat faces on each other"),
    ]


def track(scene: Scene) -> Track:
    """Place of the keystone."""
    down = motion(scene.params)[0] / math.tan(_beta(scene.params))
    x, y = scene.bodies[3].pose[:2]
    return Track("keystone", lambda t: (x, y - 0.5 * down * t * t))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Displacement of an arch that should stand, in heights; relative error of the sinking of one that gives way."""
    truth = exact(scene)
    metric, size = ("moved", TALL) if "moved" in truth else ("sinking", truth["sinking"])
    value, reason = found[metric]
    return (None, reason) if value is None else (abs(value - truth[metric]) / size, "")


SCENE = CanonicalScene(
    name="arch",
    family="stacks and statics",
    version=1,
    title="Arch of three stones: it stands or gives way",
    symptoms=(
        "an arch collapses",
        "a stone arch falls although friction should hold it",
        "the keystone drops out",
        "a vault of wedge-shaped stones slips apart",
        "a bridge of three stones pushes its feet outwards",
        "wedge-shaped blocks under load slide out",
        "a bridge of loose blocks sags",
        "the thrust of an arch is wrong",
    ),
    figure=__doc__ or "",
    law="stands if mu >= cot(beta)/(2 R + 1), N = W/(2 sin(beta)); else gives way, A = g (k - mu R)/(R + k cot(beta))",
    dimensions=(2,),
    parameters=(
        Parameter("ratio", 1.05, "1", "friction of the floor over the least that holds", 0.01, 100.0),
        Parameter("beta", 30.0, "degrees", "angle of the keystone's faces to the vertical", 10.0, 45.0),
        Parameter("heavy", 3.0, "1", "mass R of a springer over that of the keystone", 1.0, 1e3),
        standard_gravity(),
        mass_of("the keystone"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=lambda scene: Sampling(1, 0.5 * scene.duration),
    track=track,
    quick=(Variation({}), Variation({"ratio": 0.8})),
    full=tuple(
        Variation({"ratio": r, "beta": beta}) for r in (0.5, 0.8, 0.95, 1.02, 1.05, 2.0) for beta in (25.0, 30.0, 40.0)
    ),
    planted=({}, {"ratio": 0.8}),
    primary=Primary(
        "outcome error",
        "1",
        "displacement of the arch that should stand, in heights; relative error of the sinking of the one that "
        "gives way",
        "whether it stands, and how fast it moves if it does not",
        lambda dt: [{}, {"ratio": 0.8}],
        error,
        "the whole scene: the arch stands",
    ),
    smooth=("sinking",),
    words={
        "moved": "moves by {value} where it should stand",
        "face_load": "the keystone presses on a springer with {value}",
        "floor_load": "a springer presses on the floor with {value}",
        "parting": "a springer goes out with {value}",
        "parting<0": "a springer comes in with {value}",
        "sinking": "the keystone sinks with {value}",
        "sinking<0": "the keystone rises with {value}",
        "off_the_faces": "stones part or sink in by {value}",
        "turned": "turns: a corner moves by {value}",
    },
)
