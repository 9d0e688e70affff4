"""Our own sequential-impulse solver (`reference_solver`) behind the plugin line.

    step:  detect at x  ->  sample u- = J v (before forces)  ->  v* = v + h M^-1 f  ->  sweep the contact rows
           (target -e u-, accumulated clamping, Coulomb with the current total)  ->  x += h v  ->  split impulses

Two profiles: ``classical`` makes a fixed number of sweeps, as textbooks do; ``reference`` solves the same contact
equations to a residual and certifies them, in steps that are cut where bodies meet and where slides end.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, fields
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
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
from adapters.needs import Needs
from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Shape, Sphere

SOURCE = "reference_solver/README.md"
#: Why each of the solver's settings has its value; the values themselves are the solver's own.
REASONS = {
    "iterations": "what textbooks and engines use: an answer at a fixed cost, whatever is left unsolved",
    "residual": "sweep until every contact equation holds to this share of its own speed; null: fixed sweeps",
    "max_sweeps": "bound of the residual stop for broken problems; reaching it is reported as not converged",
    "relaxation": "1 is plain projected Gauss-Seidel; null estimates the best factor from the residuals",
    "position_correction": "split: overlap is corrected through pseudo-velocities that carry no energy",
    "beta": "share of an overlap that is corrected per step",
    "slop": "overlap that is left alone [m]",
    "warm_starting": "each contact starts from its impulse of the step before, matched by feature",
    "solver": "scalar: row after row, the textbook; block: the rows of a manifold together, which does not stall",
    "direct": "where sweeps turn out to be slow (mass ratios, tall columns) Newton's method ends a step; it needs a "
    "residual stop, fixed sweeps never hand over",
    "scheme": "fixed: impacts are found at the start of the step after, as engines do; located: steps are cut where "
    "bodies meet and where a slide ends",
    "margin": "pairs with e = 0 are contacts within this share of the smallest half width, closed by at most the gap; "
    "pairs with e > 0 only where they touch, so that nothing slows a body down before its impact",
}

#: Steps cut at events, with constant accelerations between them.
LOCATED = Scheme("detect, impacts, forces up to the next event, move; what is left of the step is the next part", 0)


def classical_profile(needs: Needs, dt: float) -> list[Setting]:
    """Fixed sweeps."""
    from reference_solver import Settings

    return _as_settings(Settings.classical(dt))


def reference_profile(needs: Needs, dt: float) -> list[Setting]:
    """Residual stop; there is no iteration count to replace."""
    from reference_solver import Settings

    return [s for s in _as_settings(Settings.reference(dt)) if s.name != "iterations"]


def _as_settings(chosen: Any) -> list[Setting]:
    return [
        Setting(field.name, getattr(chosen, field.name), REASONS[field.name], SOURCE)
        for field in fields(chosen)
        if field.name != "dt"
    ]


class ReferenceEngine(Engine):
    """Planar and spatial; discs, spheres, boxes, half-spaces."""

    facts = EngineFacts(
        name="reference",
        title="Reference sequential-impulse solver",
        package="contact-crosscheck",
        dimensions=frozenset({2, 3}),
        scheme=Scheme("detect, sample restitution, forces, solve, position", 1),
        customary_dt=1.0 / 60.0,
        profile_schemes=MappingProxyType({"reference": LOCATED}),
        quirks=(
            Quirk(
                "classical advances velocity before position: free fall from rest is ahead by g t dt / 2",
                "nothing: it is the scheme, and tolerances allow for a step; reference falls exactly",
                SOURCE,
            ),
            Quirk(
                "classical finds contact at the start of a step, so a bounce is found late by up to v dt",
                "nothing: it is the scheme, and tolerances allow for a step; reference cuts its steps at events",
                SOURCE,
            ),
        ),
    )
    profiles = MappingProxyType({"classical": classical_profile, "reference": reference_profile})

    def version(self) -> str:
        """Package version and eight hex digits over the solver's sources.

        Raises
        ------
        ImportError
            If the package `reference_solver` is not there.
        """
        spec = find_spec("reference_solver")
        if spec is None or not spec.submodule_search_locations:
            raise ImportError("No module named 'reference_solver'")
        root = Path(next(iter(spec.submodule_search_locations)))
        digest = hashlib.sha256()
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
        return f"{_package_version()}+{digest.hexdigest()[:8]}"

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Whatever the solver's own validation says about the model."""
        try:
            _model(scene)
        except ValueError as error:
            return str(error).splitlines()[0]
        return None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; see `Engine.build`.

        Raises
        ------
        EngineError
            For a model or a setting that the solver refuses, or a setting it does not have.
        """
        from reference_solver import Settings

        known = [field.name for field in fields(Settings) if field.name != "dt"]
        for name in settings:
            if name not in known:
                raise EngineError(f"{name}: reference has no such setting, it has {', '.join(known)}")
        try:
            return ReferenceSimulation(scene, _model(scene), Settings(dt=dt, **settings))
        except (ValueError, TypeError) as error:
            raise EngineError(str(error).splitlines()[0]) from error

    def certify(
        self, scene: Scene, dt: float, settings: Mapping[str, Any], steps: int, final_pose: Array
    ) -> dict[str, Any] | None:
        """Full certificate (`reference_solver.certification.truth`) of a profile that promises a solution."""
        from reference_solver import Settings
        from reference_solver.certification.truth import certify

        chosen = Settings(dt=dt, **settings)
        if chosen.residual is None:
            return None
        found = certify(_model(scene), chosen, steps)
        reasons = list(found.reasons)
        same = np.array_equal(found.pose[-1], final_pose)
        if not same:
            reasons.append("the run that was certified does not end where the run that is judged does")
        return {
            "holds": found.holds and same,
            "reasons": reasons,
            "error": _plain(found.error[-1]),
            "growth": _plain(found.growth[-1]),
            "horizon": _plain(found.horizon),
            "findings": {finding.name: _plain(finding.value) for finding in found.findings},
        }

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Nothing: single contacts and constant forces are exact in both profiles."""
        return {}

    def kernels(self) -> Path | None:
        """Folder of the solver's kernels; None where nothing is compiled, or where no folder can keep it."""
        from reference_solver import compilation

        return None if compilation.config.DISABLE_JIT else compilation.cache_folder()

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: the solver's settings."""
        changed = ", ".join(f"{name}={settings[name]!r}" for name in names)
        return f"from reference_solver import Settings\n\nSettings(dt={dt:.9g}, {changed})"


def _package_version() -> str:
    try:
        return version("contact-crosscheck")
    except PackageNotFoundError:  # run from a checkout that was never installed
        return "0"


def _shape(shape: Shape) -> Any:
    from reference_solver import model

    if isinstance(shape, Disc):
        return model.Disc(shape.radius)
    if isinstance(shape, Sphere):
        return model.Sphere(shape.radius)
    if isinstance(shape, Box):
        return model.Box(shape.half_extents)
    assert isinstance(shape, HalfSpace)
    return model.HalfSpace(shape.normal, shape.offset)


def _body(body: Body, dimension: int) -> Any:
    from reference_solver import model

    return model.Body(
        shape=_shape(body.shape),
        mass=body.mass,
        inertia=body.inertia,
        pose=body.pose,
        twist=body.twist,
        motion=body.motion,
        force=body.force,
        torque=body.torque[0] if dimension == 2 else body.torque,
    )


def _model(scene: Scene) -> Any:
    from reference_solver import model

    n = len(scene.bodies)
    restitution, friction = np.zeros((n, n)), np.zeros((n, n))
    for i, j, material in scene.contact_pairs():
        restitution[i, j] = restitution[j, i] = material.restitution
        friction[i, j] = friction[j, i] = material.friction
    return model.Model(
        dimension=scene.dimension,
        bodies=tuple(_body(body, scene.dimension) for body in scene.bodies),
        gravity=scene.gravity,
        restitution=restitution,
        friction=friction,
    )


class ReferenceSimulation(Simulation):
    """One `reference_solver.Simulation`."""

    def __init__(self, scene: Scene, model: Any, settings: Any) -> None:
        from reference_solver import Simulation as Solver

        self.scene, self.model, self.settings = scene, model, settings
        self.solver = Solver(model, settings)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        self.solver.advance(steps)

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return np.asarray(self.solver.pose, float)

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return np.asarray(self.solver.twist, float)

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        found = self.solver.contacts()
        a, b = (np.asarray(x, np.int64) for x in (found.body_a, found.body_b))
        return Contacts(a, b, found.point, found.normal, found.impulse, found.gap)

    def readback(self) -> dict[str, Any]:
        """Settings and model that the solver holds, and what it left out because the scene has no use for it."""
        names = [body.name for body in self.scene.bodies]
        return {
            **asdict(self.settings),
            "gravity": [float(x) for x in self.model.gravity],
            "bodies": {
                name: {"mass": float(body.mass), "inertia": np.asarray(body.inertia, float).tolist()}
                for name, body in zip(names, self.model.bodies, strict=True)
                if body.motion == "free"
            },
            "pairs": {
                f"{names[i]}-{names[j]}": {
                    "restitution": float(self.model.restitution[i, j]),
                    "friction": float(self.model.friction[i, j]),
                }
                for i, j, _ in self.scene.contact_pairs()
            },
            "left_out": list(self.solver.left_out),
        }

    def certificate(self) -> dict[str, Any]:
        """What `reference_solver.Simulation.certificate` says; ``certified`` with a residual stop, which promises it.

        A fixed number of sweeps promises nothing: what it leaves unsolved is what it is here to show.
        """
        found = {key: _plain(value) for key, value in self.solver.certificate.items()}
        return found if self.settings.residual is None else {**found, "certified": found["holds"]}


def _plain(value: Any) -> Any:
    """What JSON has a word for: lists for tuples, plain numbers for NumPy scalars, null for what is not finite."""
    if isinstance(value, tuple):
        return list(value)
    plain = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain
