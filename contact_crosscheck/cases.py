"""One case: a scene with parameters on one engine, profile and step, run and judged."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from numbers import Real
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

import pandas as pd

from adapters import registry
from adapters import scene as scene_module
from adapters.engine import Engine, EngineError
from adapters.plain import NAME, kind_of, one_line
from adapters.scene import SceneError
from adapters.settings.own import own
from adapters.trajectory import Trajectory, load_trajectory
from contact_crosscheck.apart import apart
from contact_crosscheck.models import AnyScene, scene_named
from reports.exports import described
from reports.findings import severity
from reports.wording import LABELS, ROLE_WORDS, mark_of, measured, params_text, quantity, reproduce
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE, is_introduced
from validation.cells import Observation, Outcome, Slot, format_dt, prepare, settings_of, slot_from_dict
from validation.identity import commit
from validation.judging.rows import Row, frame, rows_of
from validation.posed import resolve
from validation.questions.nulls import with_skill
from validation.running.execution import execute
from validation.running.plan import QUICK_DT
from validation.workers import TIMEOUT, run_cells

if TYPE_CHECKING:
    import altair as alt

#: An engine by its name, or one that the caller has written.
AnyEngine = str | Engine | type[Engine]
#: Warning, once for each engine, if nothing protects the caller from crashes of an engine.
UNPROTECTED = (
    "engine: {} runs in this process, without a time limit, and its crash would end Python; crosscheck new-adapter "
    "makes a package of an engine, which runs in processes of its own"
)
#: Engines of which the warning has been given.
_told: WeakSet[type] = WeakSet()


def run(
    scene: AnyScene,
    *,
    engine: AnyEngine,
    profile: str | None = None,
    dimension: int | None = None,
    dt: float | str | None = None,
    iterations: int | None = None,
    settings: Mapping[str, Any] | None = None,
    **params: float,
) -> Result:
    """Run one case and judge it.

    Engines of this project, and your own, run in this process: without a time limit, and a crash ends Python. Those of
    other packages run in a process of their own.

    Parameters
    ----------
    scene
        Name in the catalogue (`scenes`), path of a scene file or of a model, or a `Scene`. The content of a scene file
        as a table, or a scene that you have written in Python (a ``CanonicalScene``), run in the same way.
    engine
        Name of an installed engine (`engines`), or an engine of your own: a class or an object of `Engine`.
    profile
        Set of settings, by name or by role: ``as shipped``, ``tuned``, ``compromise``, ``textbook``, ``exact``. The
        default is as shipped; on our own solver exact; for a model on its own engine as its author made it (``model``).
    dimension
        2 or 3; by default the first of the scene's that the engine has itself. A 2-D scene is embedded in 3-D for an
        engine that has 3-D only.
    dt
        Step [s], also as ``"1/240"``; 1/240 by default, for a model's own profile the model's.
    iterations
        Replaces the iteration count of the profile.
    settings
        Settings of the engine by name, which replace those of the profile.
    **params
        Parameters of the scene; the others have their defaults.

    Returns
    -------
    Result
        Also if the engine refuses the scene, diverges or fails: its checks then have no value, with the reason.

    Raises
    ------
    SceneError
        For an unknown scene or parameter, or a value that the scene does not take; a `ValueError`.
    EngineError
        For an unknown engine, profile or setting, or an engine that is not installed; a `RuntimeError`.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> result = cc.run("bounce", engine="mujoco", profile="tuned", e=0.7, dt=1 / 240, dimension=3)
    >>> result.frame()[["metric", "value", "truth", "tolerance", "physics"]]
    >>> print(result.explain())
    """
    # An engine of the caller may need the caller's module, so it is hidden only for engines that are given by name.
    with apart() if isinstance(engine, str) else nullcontext():
        slot = slot_of(scene, engine_named(engine), profile, dimension, dt, iterations, settings, params)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "case.npz"
        observation = observe(slot, path)
        return Result(observation, load_trajectory(path) if path.exists() else None)


def observe(slot: Slot, path: Path | None = None) -> Observation:
    """Run a slot: engines of other packages in their own process, others here; store the trajectory at ``path``."""
    entry = registry.entry(slot.engine)
    if entry is None or registry.is_ours(entry) or is_introduced(slot.scene):
        observation = execute(slot, path)
        # An error that ends a case is its outcome, except here for Ctrl-C: it has to end the caller too.
        if observation.outcome is Outcome.CRASHED and observation.reason.startswith(KeyboardInterrupt.__name__):
            raise KeyboardInterrupt
        return observation
    with apart():
        (observation,) = run_cells([slot], timeout=TIMEOUT, keep=lambda _: path)
    return observation


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """Result of one case.

    Parameters
    ----------
    observation
        Measured quantities, with the settings of the case.
    trajectory
        Times ``t`` (s,) [s], poses ``pose`` (s, n, 3 or 7), velocities ``twist`` (s, n, 3 or 6) and ``contacts`` of all
        bodies; None if the engine returned none.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> result = cc.run("bounce", engine="chipmunk")
    >>> result.trajectory.pose[:, 1, 1].max()  # height of the ball [m]
    """

    observation: Observation
    trajectory: Trajectory | None

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies, in the order of the trajectory."""
        return [body.name for body in self._scene().bodies]

    @cached_property
    def rows(self) -> list[Row]:
        """The judged checks."""
        with apart():  # laws of another package are first examined in a process
            return with_skill(rows_of("", [self.observation]))

    def frame(self) -> pd.DataFrame:
        """Return the judged checks, one row each, with the columns of `load`.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> checks = cc.run("slide", engine="bullet").frame()
        >>> checks[checks.physics == "fail"][["metric", "value", "truth", "reason"]]
        """
        return described(frame(self.rows), "", commit(), self.rows)

    def explain(self, metric: str | None = None) -> str:
        """Explain one check: value, truth, tolerance, cause and fix.

        If the check fails, the case runs once more with the engine's profile ``tuned``, to see whether that fixes it.

        Parameters
        ----------
        metric
            Name of the check; by default the one with the largest error in units of its tolerance.

        Raises
        ------
        SceneError
            If the case has no such check.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> print(cc.run("bounce", engine="mujoco").explain("rest_time"))
        """
        from reports.command.showing import explanation

        own = [row.as_dict() for row in self.rows]
        chosen = [row for row in own if metric in (None, row["metric"])]
        if not chosen:
            raise SceneError(f"metric: there is no {metric!r}, only {', '.join(row['metric'] for row in own)}")
        row = max(chosen, key=severity)
        others = [self._tuned] if row["physics"] == "fail" and self._tuned is not None else []
        with apart():
            rows = own + [each.as_dict() for each in rows_of("", others)]
        engine = self.observation.slot.engine
        here = f"in this process only: the engine {engine!r} is in no package"
        again = here if registry.is_introduced(engine) else reproduce(self.observation.slot.as_dict())
        return explanation(rows, [self.observation, *others], row, again)

    @cached_property
    def _tuned(self) -> Observation | None:
        """The same case with the tuned profile; None if that is its profile, or with own settings or iterations."""
        slot = self.observation.slot
        tuned = registry.profile_of(slot.engine, "tuned")
        if tuned in (None, slot.profile) or slot.switched or slot.iterations is not None:
            return None
        return observe(replace(slot, profile=str(tuned)))

    def plot(self, what: str = "checks") -> alt.Chart | alt.LayerChart | alt.FacetChart:
        """Draw the checks, or the motion.

        Parameters
        ----------
        what
            ``checks``: the error of each check over its tolerance. Or a component of the free bodies over time:
            ``x``, ``y``, ``z``, ``angle`` (planar), ``vx``, ``vy``, ``vz``, ``speed``. Dashed: the reference solver's
            run of the same case, where it is certified.

        Raises
        ------
        SceneError
            If there is no such component, or no motion to draw.
        EngineError
            If the libraries of the extra ``report`` are missing.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.run("bounce", engine="mujoco", dimension=3).plot("z").save("bounce.svg")
        """
        from contact_crosscheck.charts import checks_chart, motion_chart

        if what == "checks":
            return checks_chart([row.as_dict() for row in self.rows], str(self))
        return motion_chart(self._scene(), self.trajectory, what, str(self), self._truth)

    @cached_property
    def _truth(self) -> Trajectory | None:
        """The motion of the reference solver in the same case; None if that is this one, or is not certified."""
        slot, solver = self.observation.slot, registry.solver()
        exact = registry.profile_of(solver, "solution")
        if slot.engine == solver or exact is None:
            return None
        with TemporaryDirectory() as folder:
            path = Path(folder) / "case.npz"
            found = observe(Slot(slot.scene, slot.params, slot.dimension, solver, exact, slot.dt), path)
            sound = found.outcome is Outcome.OK and path.exists()
            return load_trajectory(path) if sound else None

    def _scene(self) -> scene_module.Scene:
        slot = self.observation.slot
        return resolve(slot.scene).scene(slot.dimension, dict(slot.params))

    def __str__(self) -> str:
        slot = self.observation.slot
        said = f"{slot.scene} {slot.dimension}-D on {slot.engine}/{slot.profile}, dt {format_dt(slot.dt)} s"
        return f"{said}, {params_text(dict(slot.params))}" if slot.params else said

    def __repr__(self) -> str:
        judged = [row for row in self.rows if row.physics]
        failed = sum(row.physics == "fail" for row in judged)
        outcome = self.observation.outcome.value
        verdict = f"{failed} of {len(judged)} checks fail" if judged else f"{outcome}: {self.observation.reason}"
        return f"<{self}: {verdict}>"

    def _repr_html_(self) -> str:
        lines = []
        for row in self.rows:
            plain = row.as_dict()
            texts = [
                row.metric, measured(plain), quantity(row.truth, row.unit), quantity(row.tolerance, row.unit),
                LABELS[mark_of(plain)],
            ]  # fmt: skip
            hint = escape("; ".join(filter(None, (row.because, row.reason))), quote=True)
            lines.append(f'<tr title="{hint}">' + "".join(f"<td>{escape(text)}</td>" for text in texts) + "</tr>")
        heads = "".join(f"<th>{name}</th>" for name in ("check", "value", "truth", "tolerance", "verdict"))
        return (
            f"<table><caption>{escape(repr(self)[1:-1])}</caption>"
            f"<thead><tr>{heads}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
        )


def engine_named(engine: AnyEngine) -> str:
    """Name of an installed engine; one that the caller has written is registered here, with a warning.

    Raises
    ------
    EngineError
        If it is unknown, not installed, or no engine.
    """
    if isinstance(engine, str):
        found = registry.find(engine)
        if found.engine is None:
            raise EngineError(f"engine: {engine} is not installed: {found.reason}")
        return engine
    if not isinstance(engine, Engine | type):
        raise EngineError(f"engine: {kind_of(engine)} was given; name an engine, or give one of your own")
    name, kind = registry.introduce(engine), engine if isinstance(engine, type) else type(engine)
    if kind not in _told:
        _told.add(kind)
        warnings.warn(UNPROTECTED.format(name), stacklevel=3)
    return name


def slot_of(
    scene: AnyScene,
    engine: str,
    profile: str | None,
    dimension: int | None,
    dt: float | str | None,
    iterations: int | None,
    settings: Mapping[str, Any] | None,
    params: Mapping[str, Any],
) -> Slot:
    """Slot of the arguments of `run`, read as `run-cell` would read it.

    Raises
    ------
    SceneError, EngineError
        For a wrong argument, with its name.
    """
    name = scene_named(scene)
    canonical = resolve(name)
    profile = profile_named(engine, profile, canonical)
    brought = canonical.brought(engine, profile)
    data = {
        "scene": name,
        "params": dict(canonical.minimal({key: number_of(key, value) for key, value in params.items()})),
        "dimension": dimension_for(engine, canonical) if dimension is None else dimension,
        "engine": engine,
        "profile": profile,
        "dt": (brought.dt if brought else QUICK_DT) if dt is None else dt,
        "iterations": iterations,
    }
    try:
        slot = slot_from_dict(data)
    except SceneError as error:  # callers do not know slots
        raise SceneError(str(error).removeprefix("slot.")) from None
    prepared = prepare(slot)
    if name not in CATALOGUE:
        canonical.checks(prepared.scene, slot.dt)  # a scene that cannot be judged is refused before it runs
    asked = settings_from(settings)
    return slot.with_own(own_of(slot, asked)) if asked else slot


def settings_from(settings: Mapping[str, Any] | None) -> tuple[tuple[str, Any], ...]:
    """The caller's own settings, sorted by name.

    Raises
    ------
    EngineError
        If they are no table.
    """
    if settings is not None and not isinstance(settings, Mapping):
        raise EngineError(f"settings: {kind_of(settings)} was given; give values by name, {{'name': value}}")
    return tuple(sorted((str(name), value) for name, value in (settings or {}).items()))


def own_of(slot: Slot, asked: tuple[tuple[str, Any], ...]) -> tuple[tuple[str, Any], ...]:
    """The caller's own settings, converted and checked for the engine."""
    engine = registry.find(slot.engine).engine
    assert engine is not None  # `engine_named` has checked it
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    return own(engine, asked, settings_of(engine, slot, scene))


def profile_named(engine: str, profile: str | None, scene: CanonicalScene) -> str:
    """Name of a profile given by name or role; by default as shipped, or a model as its author made it.

    Raises
    ------
    EngineError
        If the engine has no such profile.
    """
    found, facts = registry.find(engine).engine, registry.facts(engine)
    known = list(found.profiles) if found else []
    brought = scene.brings.get(engine)
    if profile is None:
        usual = (facts.profile("shipped") or facts.profile("solution")) if facts else None
        return brought.profile if brought else usual or known[0]
    if profile in known or (brought is not None and profile == brought.profile):
        return profile
    roles = facts.roles if facts else {}
    fits = [name for name, role in roles.items() if profile in (role, ROLE_WORDS.get(role))]
    if not fits:
        raise EngineError(f"profile: {engine} has no profile {one_line(profile, NAME)!r}, only {', '.join(known)}")
    return fits[0]


def dimension_for(engine: str, scene: CanonicalScene) -> int:
    """First dimension of a scene that the engine has itself; if there is none, the scene's first."""
    facts = registry.facts(engine)
    own_ones = facts.dimensions if facts else frozenset()
    return next((each for each in scene.dimensions if each in own_ones), scene.dimensions[0])


def number_of(name: str, value: Any) -> float:
    """Value of a parameter.

    Raises
    ------
    SceneError
        If it is no number.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise SceneError(f"{name}: {one_line(repr(value), NAME)} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise SceneError(f"{name}: the number is too large") from None
