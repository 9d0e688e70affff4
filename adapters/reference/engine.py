"""The adapter of our own solver (`reference_solver`): time stepping as in textbooks, and the loop of events.

    classical, a step:   detect at x  ->  sample u- = J v (before forces)  ->  v* = v + h M^-1 f  ->  sweep the contact
                         rows (target -e u-, accumulated clamping, Coulomb with the current total)  ->  x += h v  ->
                         split impulses
    reference, a piece:  find what touches  ->  strike  ->  decide which contacts hold, stick and slip  ->  move to the
                         next event

The two profiles are in `adapters.reference.profiles`.
"""

from __future__ import annotations

import hashlib
import math
import warnings
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from pickletools import genops
from types import MappingProxyType
from typing import Any

import numpy as np

from adapters.engine import Array, Declared, Engine, EngineError, EngineFacts, Quirk, Scheme, Simulation
from adapters.needs import Needs
from adapters.plain import Notice
from adapters.receipts import FRICTION_SHARE
from adapters.receipts.probes import SLIDE_TIME, slide_load, slide_speed
from adapters.reference.profiles import FORMER, KINDS, PROFILES, SOURCE, STEPS
from adapters.reference.script import python
from adapters.reference.simulation import ReferenceSimulation, json_ready, solver_model
from adapters.reference.start import overlap_at_the_start, too_far_at_the_start
from adapters.scene import Scene
from adapters.scene.drives import as_moving

#: Largest integer of a kernel.
LARGEST = 2**63 - 1
#: Steps only say when the world is looked at.
BY_EVENTS = Scheme("find the next event, move to it, impacts, forces; whatever the step", 0)


class ReferenceEngine(Engine):
    """Planar and spatial; discs, spheres, boxes, capsules, planar polygons, half-spaces."""

    facts = EngineFacts(
        name="reference",
        title="Reference solver: textbook steps, and events",
        package="contact-crosscheck",
        dimensions=frozenset({2, 3}),
        scheme=Scheme("detect, sample restitution, forces, solve, position", 1),
        customary_dt=1.0 / 60.0,
        roles=MappingProxyType({"classical": "textbook", "reference": "solution"}),
        colour="#3568ad",
        abilities=frozenset({"moving half-space", "turning half-space", "capsule", "polygon"}),
        profile_schemes=MappingProxyType({"reference": BY_EVENTS}),
        quirks=(
            Quirk(
                "classical updates velocity before position: free fall from rest is ahead by g t dt / 2",
                "unchanged: tolerances allow for a step; reference falls exactly",
                SOURCE,
            ),
            Quirk(
                "classical detects contacts at the start of a step, so a bounce is late by up to v dt",
                "unchanged: tolerances allow for a step; reference finds the instant",
                SOURCE,
            ),
        ),
    )
    profiles = PROFILES
    kinds, former = KINDS, FORMER
    exports = MappingProxyType({"python": python})
    #: Events grow with bodies that touch: heaps of more take minutes, or end in a refusal.
    most_bodies = 100

    def version(self) -> str:
        """Package version and eight hex digits over the solver's sources.

        Raises
        ------
        ImportError
            If the package `reference_solver` is missing.
        """
        spec = find_spec("reference_solver")
        if spec is None or not spec.submodule_search_locations:
            raise ImportError("No module named 'reference_solver'")
        root = Path(next(iter(spec.submodule_search_locations)))
        digest = hashlib.sha256()
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
        return f"{_package_version()}+{digest.hexdigest()[:8]}"

    def listed(self) -> str:
        """See `Engine.listed`; its sources are no import."""
        return self.version()

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """The result of the solver's own validation.

        In a certified profile also bodies that overlap, or are too far away, at the start.
        """
        try:
            solver_model(scene)
        except ValueError as error:
            return str(error).splitlines()[0]
        if self.facts.roles[profile] != "solution":
            return None
        return overlap_at_the_start(scene) or too_far_at_the_start(scene)

    def check_settings(self, settings: Mapping[str, Any]) -> None:
        """See `Engine.check_settings`."""
        try:
            _checked(settings, 1.0)
        except (ValueError, TypeError, OverflowError) as error:
            raise EngineError(str(error).splitlines()[0]) from None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; see `Engine.build`.

        Raises
        ------
        EngineError
            For a model or a setting that the solver refuses, or an unknown setting.
        """
        _heal_once()
        try:
            return ReferenceSimulation(scene, solver_model(scene), _checked(settings, dt))
        except (ValueError, TypeError) as error:
            raise EngineError(str(error).splitlines()[0]) from error
        except OverflowError as error:
            wrong = [name for name, value in settings.items() if isinstance(value, float) and not math.isfinite(value)]
            raise EngineError(f"{', '.join(wrong) or 'scene'}: {error}") from None

    def certify(
        self,
        scene: Scene,
        dt: float,
        settings: Mapping[str, Any],
        steps: int,
        final_pose: Array,
        others: Sequence[Array] = (),
    ) -> dict[str, Any] | None:
        """Full certificate (`reference_solver.certificate.truth`) of a certified profile."""
        from reference_solver import Settings
        from reference_solver.certificate.truth import certify

        chosen = Settings(dt=dt, **settings)
        if chosen.tolerance is None:
            return None
        found = certify(solver_model(as_moving(scene)), chosen, steps, others=others)
        reasons = list(found.reasons)
        free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]  # others' motion is given
        same = np.array_equal(found.pose[-1][free], final_pose[free])
        broken = {finding.name for finding in found.findings if not finding.holds}
        determined = math.isinf(found.determined)
        if not determined and "shared" not in broken:  # beyond the horizon, or it ends there
            shared = next(finding for finding in found.findings if finding.name == "shared")
            why = found.unique if found.several else shared.meaning
            reasons = [why, *(reason for reason in reasons if reason != why)]
        if not same:
            reasons.append("the certified run does not end where the judged run does")
        return {
            "holds": found.holds and same and determined,
            "lawful": bool(same and broken <= {"shared"}),  # one of several motions that satisfy the laws
            "reasons": reasons,
            "error": json_ready(found.error[-1]),
            "growth": json_ready(found.growth[-1]),
            "horizon": json_ready(found.horizon),
            "determined": json_ready(found.determined),
            "unique": found.unique,
            "several": found.several,
            "findings": {finding.name: json_ready(finding.value) for finding in found.findings},
        }

    def at_other_tolerances(
        self, settings: Mapping[str, Any], certificate: Mapping[str, Any]
    ) -> list[Mapping[str, Any]]:
        """See `Engine.at_other_tolerances`: a tenth of the tolerance and ten times it."""
        from reference_solver.certificate.truth import tolerances_beside

        if certificate.get("closed", True):  # steps have none
            return []
        return [{**settings, "tolerance": each} for each in tolerances_beside(settings["tolerance"])]

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Friction of a rebounding box in 3-D with fixed sweeps; all else is exact in both profiles.

        Fixed sweeps over the four corners of a face have a residual of about 1e-8 m/s. For e > 0 a corner lifted by it
        does not touch, and the box rocks: each corner leaves with up to (1 + e) times the speed that gravity gives in a
        step. The box is no higher than wide, so its corners slip sideways no faster than that, and the friction along
        the path is reduced by a cosine. This bounds one step's rebound, not the sum of several: measured with ten
        sweeps it is 0.02 to 0.24 of the share below at e = 1, 1/30 and 1/60 s, and round-off at smaller steps; in 2-D,
        at e = 0, and with twenty sweeps (tried at mu = 0.3) round-off as well.
        """
        if (
            self.facts.roles[profile] == "solution"
            or needs.dimension == 2
            or not needs.restitution > 0.0 < needs.friction
        ):
            return {}
        load = slide_load(needs.friction)
        slowest = slide_speed(needs.friction) - needs.friction * load * SLIDE_TIME
        share = 0.5 * ((1.0 + needs.restitution) * load * dt / slowest) ** 2
        because = (
            "a box that rocks because of the fixed sweeps slips sideways at its corners, by (1 + e) g dt: 1 - "
            "cos of friction"
        )
        band = (0.5 * share + FRICTION_SHARE) * needs.friction
        told = Declared((1.0 - 0.5 * share) * needs.friction, band, because)
        return {"friction": told, "friction_impulse": told}

    def kernels(self) -> Path | None:
        """Folder for marks, named after all sources; None without compilation, or without a writable folder.

        Damaged files of kernels, as after a power cut, are thrown away.
        """
        return next(iter(_heal_kernels()), None)

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: the solver's settings."""
        changed = ", ".join(f"{name}={settings[name]!r}" for name in names)
        return f"from reference_solver import Settings\n\nSettings(dt={dt:.9g}, {changed})"


def _heal_kernels() -> tuple[Path, ...]:
    """Heal the folders of these sources, and return them."""
    from reference_solver import compilation

    folders = () if compilation.config.DISABLE_JIT else compilation.cache_folders()
    _heal(*folders)
    return folders


#: Looks at the kernels before the first world of this process.
_heal_once = cache(_heal_kernels)


def _heal(*folders: Path) -> None:
    """Delete damaged files of kernels, and the marks that say that all are compiled.

    numba renames files that are complete, so none is damaged because it is being written.
    """
    with suppress(OSError):
        damaged = [path for folder in folders for path in folder.rglob("*.nb[ic]") if not _is_whole(path)]
        marks = [path for folder in folders for path in folder.iterdir() if path.is_file()]
        for path in damaged and damaged + marks:
            path.unlink(missing_ok=True)
        if damaged:
            count = "1 damaged file" if len(damaged) == 1 else f"{len(damaged)} damaged files"
            warnings.warn(Notice(f"kernels: {count} thrown away; what is missing is compiled again"), stacklevel=2)


def _is_whole(path: Path) -> bool:
    """Whether a file of numba consists of two pickles (an index) or of one (machine code); none is loaded."""
    data = path.read_bytes()
    stream, count = BytesIO(data), 0
    try:
        while stream.tell() < len(data):
            for _ in genops(stream):
                pass
            count += 1
    except Exception:  # what is no pickle may raise anything
        return False
    return count == (2 if path.suffix == ".nbi" else 1)


def _checked(settings: Mapping[str, Any], dt: float) -> Any:
    """Settings of the solver for steps of ``dt`` [s].

    Raises
    ------
    EngineError
        For an unknown setting, one of another profile, or an integer beyond the range of a kernel.
    ValueError, TypeError, OverflowError
        For a value that it refuses.
    """
    from reference_solver import Settings

    by_events = "tolerance" in settings
    if by_events and settings.keys() >= STEPS:
        raise EngineError("tolerance: is of profile reference; classical makes steps, which have no such setting")
    for name, value in settings.items():
        if name not in KINDS:
            raise EngineError(f"{name}: reference has no such setting, it has {', '.join(KINDS)}")
        if by_events and name in STEPS:
            raise EngineError(f"{name}: is of the steps of profile classical; profile reference has tolerance alone")
        if isinstance(value, int) and value > LARGEST:
            raise EngineError(f"{name}: is larger than {LARGEST}, the largest integer of a kernel")
    return Settings(dt=dt, **settings)


def _package_version() -> str:
    try:
        return version("contact-crosscheck")
    except PackageNotFoundError:  # run from a checkout without installation
        return "0"
