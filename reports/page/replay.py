"""Replays: recordings of all engines on one scene, packed for the page's player, with the truth as a ghost.

    heads (JSON, deflated, of all scenes at once)     bodies, series, size of a level
    levels of one scene, deflated    16-bit integers: times in steps, then one quantity after the other, each as
                                     changes along time; low bytes first
    who (JSON, once for all scenes)  name, colour and dash of each engine and profile

The player only draws and computes nothing. The moments at which an engine leaves the tube of
`validation.running.tracks` were computed from the full trajectory when the case ran.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from adapters.scene import Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, Scene, Sphere
from adapters.scene.shapes import reach
from reports.page import figures
from reports.page.figures import Figure
from reports.page.opening import shown
from reports.page.source import Source
from reports.page.verdicts import slug
from reports.palette import colours_of, dash_of
from reports.wording import params_text, reproduce
from validation.cells import Slot, format_dt
from validation.posed import resolve
from validation.running.tracks import Recording

#: Levels of a length over the largest extent of the scene: half a pixel of a screen 4000 pixels wide.
LENGTHS = 8000
#: Levels of a contact's point and impulse: arrows cannot be read more finely than a hundredth.
ARROWS = 250
#: Levels of an angle per radian, and of a quaternion's component.
ANGLES = 4000
#: The camera does not follow bodies that an engine threw further than this many extents of the exact motion.
FOLLOWED = 3.0


def people(source: Source) -> list[dict[str, Any]]:
    """Name, colour and dash of each engine and profile, in the numbering of the player's series."""
    colours = colours_of(source.engines)
    return [
        {"name": f"{engine}/{profile}", "colour": colours[engine], "dash": list(dash_of(profile))}
        for engine, profile in source.columns
    ]


@dataclass(frozen=True)
class Replay:
    """One scene and dimension, for the player and, without JavaScript, as a figure and a sentence."""

    id: str
    title: str
    settings: str
    head: dict[str, Any]
    levels: str
    figure: Figure | None
    command: str
    departures: list[tuple[str, str, float | None, str]]

    @property
    def departures_text(self) -> str:
        """Engines that leave the tolerance, and when, in order: ``one/default at 0.100 s; the other 3 never``."""
        gone = sorted((d for d in self.departures if d[2] is not None), key=lambda d: d[2] or 0.0)
        said = [f"{e}/{p} at {t:.3f} s{' (diverged)' if end == 'diverged' else ''}" for e, p, t, end in gone]
        said += [f"{e}/{p} diverged" for e, p, t, end in self.departures if t is None and end == "diverged"]
        stay = len(self.departures) - len(said)
        if not said:
            return "no engine leaves the tolerance"
        return f"{', '.join(said)}" + (
            f"; the other {stay} never" if stay > 1 else "; the other one never" if stay else ""
        )


def heads(shown: Sequence[Replay]) -> str:
    """Heads of all scenes for the player, by id; together they deflate to a tenth, because they are much alike."""
    text = json.dumps({replay.id: replay.head for replay in shown}, separators=(",", ":"), allow_nan=False)
    return _deflated(text.encode())


def _deflated(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode()


def replays(source: Source) -> list[Replay]:
    """All recorded scenes: first the one that shows a rebound, then in the order of the run."""
    groups: dict[tuple[str, int], list[tuple[Slot, Recording]]] = defaultdict(list)
    for slot, recording in source.replays:
        groups[slot.scene, slot.dimension].append((slot, recording))
    bounced, *_ = shown(source, series=True) or ("",)
    order = sorted((line for line in source.lines if line in groups), key=lambda line: line[0] != bounced)
    drawn = {scene: dimension for scene, dimension in reversed(order)}  # a motion is drawn once, in 2-D if possible
    return [_replay(source, *line, groups[line], drawn[line[0]] == line[1]) for line in order]


def _replay(
    source: Source, name: str, dimension: int, members: Sequence[tuple[Slot, Recording]], drawn: bool
) -> Replay:
    slot = members[0][0]
    canonical = resolve(name)
    scene = canonical.scene(dimension, dict(slot.params))
    track = canonical.track(scene)
    t = max((recording.t for _, recording in members), key=len)
    exact = None if track is None else np.array([track.position(float(s)) for s in t])
    tracked = None if track is None else scene.index(track.body)
    title = f"{name} {dimension}-D"
    return Replay(
        slug("replay", name, dimension),
        title,
        f"{params_text(scene.params)}, dt = {format_dt(slot.dt)} s",
        *_packed(source, scene, members, t, exact, tracked),
        _figure(title, scene, members, exact, tracked) if drawn else None,
        reproduce(slot.as_dict() | {"engine": "ENGINE", "profile": "PROFILE"}),
        [(s.engine, s.profile, r.departure, r.finish) for s, r in members],
    )  # fmt: skip


def _packed(
    source: Source,
    scene: Scene,
    members: Sequence[tuple[Slot, Recording]],
    t: NDArray[np.float64],
    exact: NDArray[np.float64] | None,
    tracked: int | None,
) -> tuple[dict[str, Any], str]:
    """Head and levels."""
    d, places = scene.dimension, {column: k for k, column in enumerate(source.columns)}
    free = [i for i, body in enumerate(scene.bodies) if body.motion != "fixed"]
    low, high = _view(scene, members, exact, tracked, free)
    unit = float(max(high - low)) / LENGTHS
    strongest = max((float(np.abs(r.impulse).max()) for _, r in members if len(r.impulse)), default=1.0)
    dt = members[0][0].dt
    blocks = [np.diff(np.round(t / dt), prepend=0.0).astype(np.int16)]
    series = []
    for slot, recording in members:
        blocks += [_pose_levels(recording.pose[:, free], d, unit), *_arrow_levels(recording, unit, strongest)]
        one: dict[str, Any] = {"who": places[slot.engine, slot.profile], "contacts": len(recording.frame)}
        if len(recording.t) < len(t):
            one["frames"] = len(recording.t)
        if recording.departure is not None:
            one["departure"] = round(recording.departure, 6)
        series.append(one)
    if exact is not None:
        blocks.append(_differenced(np.round(exact / unit)))
    # Low bytes, then high ones: the high bytes of small steps are nearly all equal, which deflates very well.
    levels = np.concatenate([block.ravel() for block in blocks]).astype("<i2")
    raw = levels.view(np.uint8).reshape(-1, 2).T.tobytes()
    head = {
        "dimension": d, "dt": dt, "count": len(t), "bodies": [_body(scene, i) for i in free],
        "fixed": [_body(scene, i) for i in range(len(scene.bodies)) if i not in free],
        "tracked": None if tracked is None else free.index(tracked), "low": _plain(low), "high": _plain(high),
        "unit": unit, "angle": 1.0 / ANGLES, "place": _coarse(unit), "arrow": 1.0 / ARROWS,
        "gravity": list(scene.gravity),
        "static": exact is not None and bool(np.ptp(exact, axis=0).max() == 0.0), "series": series,
    }  # fmt: skip
    return head, _deflated(raw)


def _plain(values: NDArray[np.float64]) -> list[float]:
    return [round(float(value), 6) for value in values]


def _view(
    scene: Scene,
    members: Sequence[tuple[Slot, Recording]],
    exact: NDArray[np.float64] | None,
    tracked: int | None,
    free: Sequence[int],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the camera's view: bodies at the start, the exact motion, and engines as far as they are followed."""
    d = scene.dimension
    start = np.array([scene.bodies[i].pose[:d] for i in free])
    around = max(reach(scene.bodies[i].shape) for i in free)
    known = start if exact is None else np.concatenate([start, exact])
    low, high = known.min(0) - around, known.max(0) + around
    room = FOLLOWED * (high - low)
    for _, recording in members:
        seen = recording.pose[:, free, :d].reshape(-1, d)
        low = np.minimum(low, np.maximum(seen.min(0) - around, low - room))
        high = np.maximum(high, np.minimum(seen.max(0) + around, high + room))
    return low, high


def _body(scene: Scene, i: int) -> dict[str, Any]:
    body = scene.bodies[i]
    shape, d = body.shape, scene.dimension
    plain: dict[str, Any] = {"name": body.name, "start": list(body.pose)}
    if isinstance(shape, Box):
        return plain | {"type": "box", "half": list(shape.half_extents)}
    if isinstance(shape, HalfSpace):
        return plain | {"type": "face", "normal": list(shape.normal), "offset": shape.offset}
    if isinstance(shape, Disc | Sphere):
        return plain | {"type": "ball", "radius": shape.radius, "dimension": d}
    return plain | {"type": "corners", "corners": [_plain(np.array(corner)) for corner in _corners(shape, d)]}


def _corners(shape: Capsule | Cylinder | Polygon | Hull, dimension: int) -> list[tuple[float, ...]]:
    """Points whose hull is, or looks like, the shape; for round shapes some points of the outline."""
    if isinstance(shape, Polygon | Hull):
        return [*shape.vertices]
    turns = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    if isinstance(shape, Cylinder):
        ring = [(shape.radius * np.cos(a), shape.radius * np.sin(a)) for a in turns]
        return [(x, y, z) for x in (-shape.half_length, shape.half_length) for y, z in ring]
    outline: list[tuple[float, ...]] = [
        (float(np.copysign(shape.half_length, np.cos(a))) + shape.radius * np.cos(a), shape.radius * np.sin(a))
        for a in turns + np.pi / 32
    ]
    if dimension == 2:
        return outline
    return [(x, y * np.cos(a), y * np.sin(a)) for x, y in outline for a in (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4)]


def _pose_levels(pose: NDArray[np.float64], dimension: int, unit: float) -> NDArray[np.int16]:
    """Bodies x components, each over all frames, as integers."""
    d = dimension
    return _differenced(np.concatenate([np.round(pose[..., :d] / unit), np.round(pose[..., d:] * ANGLES)], axis=-1))


def _differenced(levels: NDArray[np.float64]) -> NDArray[np.int16]:
    """One quantity after the other, each with its start and then its changes; sums wrap around as in the browser."""
    clipped = np.clip(np.nan_to_num(levels), -32000, 32000).astype(np.int64)
    return _by_quantity(np.diff(clipped, axis=0, prepend=0))


def _by_quantity(levels: NDArray[Any]) -> NDArray[np.int16]:
    """All of the first quantity, then all of the next: neighbouring values are alike, and deflate to less."""
    return np.ascontiguousarray(levels.reshape(len(levels), math.prod(levels.shape[1:])).T).astype(np.int16)


def _arrow_levels(recording: Recording, unit: float, strongest: float) -> list[NDArray[np.int16]]:
    """Frames (differenced), points and impulses of all contacts."""
    coarse = _coarse(unit)
    return [
        np.diff(recording.frame, prepend=0).astype(np.int16),
        _by_quantity(np.clip(np.round(recording.point / coarse), -32000, 32000)),
        _by_quantity(np.round(recording.impulse / strongest * ARROWS)),
    ]


def _coarse(unit: float) -> float:
    """Size of a level of a contact's place [m]."""
    return unit * LENGTHS / ARROWS


def _figure(
    title: str,
    scene: Scene,
    members: Sequence[tuple[Slot, Recording]],
    exact: NDArray[np.float64] | None,
    tracked: int | None,
) -> Figure | None:
    """Picture for readers without JavaScript: the coordinate with the largest travel, or the distance from rest."""
    if exact is None or tracked is None:
        return None
    d, axes = scene.dimension, ("x", "y") if scene.dimension == 2 else ("x", "y", "z")
    travel = np.ptp(exact, axis=0)
    moving = bool(travel.max() > 0.0)
    along = int(np.argmax(travel))
    parts = []
    for slot, r in members:
        seen = r.pose[:, tracked, :d]
        value = seen[:, along] if moving else np.maximum(np.linalg.norm(seen - exact[: len(seen)], axis=1), 1e-6)
        parts.append(pd.DataFrame({"t": r.t, "value": value, "engine": slot.engine, "profile": slot.profile}))
    name = scene.bodies[tracked].name
    longest = max((r.t for _, r in members), key=len)
    truth = pd.DataFrame({"t": longest, "value": exact[:, along]}) if moving else None
    what = f"{axes[along]} of {name} [m]" if moving else f"distance of {name} from rest [m]"
    return figures.motion(pd.concat(parts), truth, what, f"{title}: {name} over time")
