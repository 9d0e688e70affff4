"""A scene from a file, after reading and checking.

It has no closed form: final positions, angles, velocities and forces are shown without a truth, unless its author
states a value; the invariants of any scene (`validation.files.invariants`) are judged. Nothing here reads files, so a
scene can be sent as plain data (`Stated.as_dict`) to processes without the packages that check files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from adapters.extras import install
from adapters.scene import Scene, scene_from_dict
from adapters.trajectory import Sampling, Trajectory
from validation import metrics
from validation.canonical import CanonicalScene, Check, Measured
from validation.files import invariants
from validation.files.expressions import value_of
from validation.files.forces import is_over_time
from validation.files.quantities import force_window, parts_of, quantity, shown_quantities, unit

#: Source of values stated by a scene's author.
STATED = "the scene file's [[checks]]"


@dataclass(frozen=True)
class StatedCheck:
    """A check by the scene's author; see `validation.files.scene_format.CheckModel`.

    A tolerance may be a formula in the step `dt`; ``names`` has its other names. ``over`` is the statistic of a
    quantity with step values (`validation.metrics.OVER_TIME`); None is its mean.
    """

    quantity: str
    value: float
    tolerance: float | str
    at: float | None
    because: str
    names: Mapping[str, float] = field(default_factory=dict)
    over: str | None = None

    @property
    def metric(self) -> str:
        """Name of the metric that it judges."""
        return metric_of(self.quantity, self.at, self.over)

    def bound(self, dt: float) -> float:
        """Tolerance at step ``dt`` [s], in the quantity's unit."""
        return value_of(self.tolerance, {**self.names, "dt": dt})


@dataclass(frozen=True)
class Stated:
    """Content of a file: a scene, notes about filled-in values, checks, and the growth of its motion.

    ``growth`` is that of `validation.canonical.CanonicalScene`.
    """

    scene: Scene
    notes: tuple[str, ...]
    checks: tuple[StatedCheck, ...]
    growth: float = 1.0

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready) that `stated_from_dict` reads back."""
        checks = [asdict(check) for check in self.checks]
        return {"scene": self.scene.as_dict(), "notes": list(self.notes), "checks": checks, "growth": self.growth}


def stated_from_dict(data: Mapping[str, Any]) -> Stated:
    """Inverse of `Stated.as_dict`."""
    checks = tuple(StatedCheck(**check) for check in data["checks"])
    # Older scenes have no growth.
    return Stated(scene_from_dict(data["scene"]), tuple(data["notes"]), checks, data.get("growth", 1.0))


def canonical_of(read: Stated, title: str) -> CanonicalScene:
    """Wrap a stated scene so that it runs like a scene of the catalogue."""
    scene = read.scene
    return CanonicalScene(
        name=scene.name,
        version=scene.version,
        title=title,
        figure="",
        law="no closed form; energy never grows, bodies do not overlap",
        dimensions=(scene.dimension,),
        parameters=(),
        make=lambda dimension, params: scene,
        exact=lambda scene: _exact(read),
        measure=lambda scene, trajectory: _measure(read, trajectory),
        rule=lambda scene, dt, truth: _checks(read, dt),
        sampling=lambda scene: Sampling(1, _contacts_from(read)),
        growth=lambda scene: read.growth,
        notes=read.notes,
    )


def _contacts_from(read: Stated) -> float:
    """Time from which contacts are recorded [s]: for forces at the end, or the first instant of one."""
    names = [body.name for body in read.scene.bodies]
    over_time = [check for check in read.checks if is_over_time(parts_of(check.quantity, names)[2])]
    instants = [check.at for check in over_time if check.at is not None]
    return min([read.scene.duration - force_window(read.scene), *instants])


def _exact(read: Stated) -> dict[str, float]:
    return {"energy_growth": 0.0, "penetration": 0.0, **{check.metric: check.value for check in read.checks}}


def metric_of(name: str, at: float | None = None, over: str | None = None) -> str:
    """Name of a quantity's metric: ``final[ball.y]``, ``at[0.25 s][ball.y]``, ``least[floor/ball.fy]``."""
    when = "final" if at is None else f"at[{at:.12g} s]"
    if over in (None, "mean"):
        return f"{when}[{name}]"
    return f"{over}[{name}]" if at is None else f"{over} {when}[{name}]"


def instant_of(metric: str) -> float | None:
    """Time [s] of a metric of the motion until then; None for others, and for forces of steps around it."""
    found = re.match(r"at\[([^ ]+) s\]\[.*\.(\w+)\]$", metric)
    return float(found[1]) if found and not is_over_time(found[2]) else None


def _measure(read: Stated, trajectory: Trajectory) -> dict[str, Measured]:
    overlaps: invariants.Overlaps = {}
    try:
        overlaps = metrics.overlaps(read.scene, trajectory)
        beyond, depth = invariants.deepest(read.scene, trajectory, overlaps)
    except ModuleNotFoundError:
        beyond = depth = None, f"overlaps of cylinders and hulls need coal: {install('shapes')}"
    measured: dict[str, Measured] = {
        "energy_growth": invariants.energy_growth(read.scene, trajectory, overlaps),
        "penetration": beyond,
        "deepest_overlap": depth,
    }
    for name in shown_quantities(read.scene):
        measured[metric_of(name)] = quantity(read.scene, trajectory, name)
    for check in read.checks:
        measured[check.metric] = quantity(read.scene, trajectory, check.quantity, check.at, check.over)
    return measured


def _checks(read: Stated, dt: float) -> list[Check]:
    told = {check.metric: check for check in read.checks}
    final = "shown to compare engines: the file states no value for it"
    names = {metric_of(name): name for name in shown_quantities(read.scene)}
    shown = [Check(metric, unit(name), None, None, final, "") for metric, name in names.items() if metric not in told]
    depth = Check("deepest_overlap", "m", None, None, "shown: its tolerance is subtracted in `penetration`", "")
    return [*invariants.checks(read.scene, dt), *(_stated_check(m, c, dt) for m, c in told.items()), depth, *shown]


def _stated_check(metric: str, check: StatedCheck, dt: float) -> Check:
    return Check(metric, unit(check.quantity), check.value, check.bound(dt), check.because, STATED)
