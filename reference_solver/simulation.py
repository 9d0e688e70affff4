"""The public face of the solver: build, advance, read.

The loop of events and the textbooks of both dimensions are packages behind one interface: a class ``World``:

    World(model, settings, needs, certified)
        Allocates all arrays. `needs` says what to model; what it lacks is left out. `certified`: see `Simulation`.
    world.pose, world.twist     (n, 3 | 7), (n, 3 | 6) float64, current state (simulation hands out copies)
    world.run(steps, stride, contacts) -> Frames
        Make `steps` steps in one compiled call (a call may be split where a buffer must grow), sampling the state
        after every `stride` steps (stride 0: no samples; `contacts`: also the contacts of the step before each
        sample).
    world.contacts() -> Contacts     of the last step made
    world.step_problem() -> StepProblem     of the next step, which is not made
    world.tally                      of a textbook: float64 array over the whole run, see tally.py
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Protocol, Self

import numpy as np

from reference_solver.checks import require_count
from reference_solver.model import Array, Model
from reference_solver.needs import EVERYTHING, Needs, needs
from reference_solver.pieces import Journal, pieces_of
from reference_solver.records import Contacts, Frames, Record, joined
from reference_solver.settings import Settings
from reference_solver.step_problem import StepProblem
from reference_solver.tally import OPENED, merge, new_tally
from reference_solver.tally_summary import columns, summary


class World(Protocol):
    """A world in motion. Steps have a `tally`; the loop of events has `recorded` and `is_closed`."""

    pose: Array
    twist: Array
    tally: Array

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps."""

    @property
    def is_closed(self) -> bool:
        """Whether the event loop has made no step to its tolerance."""

    def recorded(self, steps: int, stride: int, contacts: bool) -> tuple[Frames, Journal]:
        """Make steps of the event loop; return what was done as well."""

    def copy(self) -> Self:
        """Return a world of its own in the same state."""

    def contacts(self) -> Contacts:
        """Contacts of the last step."""

    def step_problem(self) -> StepProblem:
        """Contact problem of the next step."""


#: What is counted of a run that is not certified.
UNCERTIFIED = ("sweeps", "worst_sweeps", "projected")

#: Package of each dimension, imported when first used: loading kernels costs time. The event loop serves both.
WORLDS = {2: "reference_solver.textbook2", 3: "reference_solver.textbook3"}
EVENT_LOOP = "reference_solver.exact"


class Simulation:
    """A model being stepped.

    Parameters
    ----------
    model, settings
        Both already validated by their own constructors.
    model_everything
        Leave nothing out, whatever the model needs; the answer must be the same (for tests).
    certified
        Measure how good each contact solve of a step is (`certificate`). A fixed number of sweeps can do without: the
        motion has the same bits, and a step takes less time. Sweeps to a residual are always certified.
    """

    def __init__(
        self, model: Model, settings: Settings, *, model_everything: bool = False, certified: bool = True
    ) -> None:
        self.model = model
        self.settings = settings
        self.needs: Needs = EVERYTHING if model_everything else needs(model)
        package = import_module(WORLDS[model.dimension] if settings.tolerance is None else EVENT_LOOP)
        self._certified = certified or settings.residual is not None
        self._world: World = package.World(model, settings, self.needs, self._certified)
        self._steps = 0

    def __copy__(self) -> Self:
        """Return a simulation of its own that goes on from the same state, with the same bits.

        Arrays that are copied one by one lose the strides of zero by which laws of pairs are one number: of such a
        table all kernels would be compiled anew.
        """
        other = object.__new__(type(self))
        vars(other).update(vars(self), _world=self._world.copy())
        return other

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """See `__copy__`: model and settings cannot change."""
        return self.__copy__()

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps; afterwards positions and velocities belong to the same instant.

        Raises
        ------
        ValueError
            If ``steps`` is negative.
        """
        require_count("steps", steps, 0)
        self._world.run(steps, 0, False)
        self._steps += steps

    def record(
        self,
        steps: int,
        stride: int = 1,
        contacts: bool = False,
        certificates: bool = False,
        pieces: bool = False,
    ) -> Record:
        """Make ``steps`` steps and return the samples at the start and after every ``stride`` steps.

        With ``certificates`` every sample tells how good the steps since the one before were; compiled code is then
        entered once a sample instead of once a run. With ``pieces`` all that the loop of events does is recorded as
        well, for an audit. The answer has the same bits either way.

        Raises
        ------
        ValueError
            If ``steps`` is negative or ``stride`` below 1, or pieces are asked of steps, or certificates of the loop.
        """
        require_count("steps", steps, 0)
        require_count("stride", stride, 1)
        if pieces and self.settings.tolerance is None:
            raise ValueError("pieces: the loop of events has them; a step of length dt has none")
        if certificates:
            self._require_steps()
        first, start_pose, start_twist = self._steps, self.pose, self.twist
        tallies: list[Array] = []
        journals: list[Journal] = []
        if pieces:
            frames, journal = self._world.recorded(steps, stride, contacts)
            journals.append(journal)
        elif certificates:
            frames, tallies = self._in_parts(steps, stride, contacts)
        else:
            frames = self._world.run(steps, stride, contacts)
        self._steps += steps
        count = len(frames.pose)
        return Record(
            t=np.multiply(first + stride * np.arange(count + 1), self.settings.dt, dtype=np.float64),
            pose=np.concatenate([start_pose[None], frames.pose]),
            twist=np.concatenate([start_twist[None], frames.twist]),
            offset=np.concatenate([[0], frames.offset]),
            contacts=frames.contacts,
            certificates=columns([new_tally(), *tallies]) if certificates else {},
            pieces=pieces_of(journals, self.model.dimension, self.settings.dt, first) if pieces else None,
        )

    def _in_parts(self, steps: int, stride: int, contacts: bool) -> tuple[Frames, list[Array]]:
        """Run sample by sample: each part has a tally, which is then entered in that of the run."""
        whole, parts, tallies = self._world.tally.copy(), [], []
        for chunk in [stride] * (steps // stride) + [steps % stride] * (steps % stride > 0):
            self._world.tally[:] = 0.0
            self._world.tally[OPENED] = whole[OPENED]  # only the first solve of the run is at its start
            parts.append(self._world.run(chunk, stride, contacts))
            tallies.append(self._world.tally.copy())
            merge(whole, tallies[-1])
        self._world.tally[:] = whole
        return joined(parts or [self._world.run(0, stride, contacts)]), tallies[: steps // stride]

    def _require_steps(self) -> None:
        if self.settings.tolerance is not None:
            raise ValueError("certificate: of steps; reference_solver.certificate.truth.certify judges the event loop")

    @property
    def pose(self) -> Array:
        """Poses (n, 3 | 7), a copy."""
        return self._world.pose.copy()

    @property
    def twist(self) -> Array:
        """Twists (n, 3 | 6), a copy."""
        return self._world.twist.copy()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self.settings.dt

    @property
    def is_closed(self) -> bool:
        """Whether all motion of the event loop so far is in closed form: any tolerance gives the same bits."""
        return self._world.is_closed

    def contacts(self) -> Contacts:
        """Contacts of the last step with the impulses it applied."""
        return self._world.contacts()

    def step_problem(self) -> StepProblem:
        """Contact problem that a step of length `Settings.dt` from here has to solve (E64); nothing moves."""
        return self._world.step_problem()

    @property
    def certificate(self) -> dict[str, Any]:
        """How well answers of steps solve their own equations, over the run; without ``certified`` `UNCERTIFIED` alone.

        Raises ValueError for the event loop, which `certificate.truth.certify` judges.

        ``holds``
            Whether every share below is within its gate (`tally_summary.GATES`).
        ``reasons``
            What failed, one sentence each.
        ``residual``, ``sweeps``, ``worst_sweeps``, ``converged``
            Worst natural map the sweeps ended with (E14), their total, those of the worst step, whether every step
            reached `Settings.residual` (always true without a residual stop).
        ``natural``, ``cone``, ``pull``, ``excess``
            Worst shares by which a contact misses its law: natural map (E14), friction cone (E60), negative normal
            impulse, friction beyond mu p_n.
        ``penetration``, ``projected``
            Worst overlap at detection as a share of the smaller half width; worst position correction of a step [m].
        ``start_overlap``
            Worst overlap at the start of the run, as a share of the smaller half width.
        ``resolution``
            Coarsest last place of a body's coordinates, as a share of its smallest half width.
        ``momentum``, ``energy``
            Worst shares by which a body's momentum (E61) or a solve's kinetic energy (E62) does not balance.
        ``pumped``, ``created``, ``kane``
            Largest share of its work that a contact solve created without, and with, restitution (E63), and how many
            solves did so with restitution: a property of Newton's law, reported and no failure.
        ``contact_work``, ``surface_work``, ``load_work``
            Sums over the run [J]: of impulses on relative motion, of prescribed surfaces on bodies, of loads (E62).
        ``solves``
            Contact solves certified.
        ``direct``, ``factorisations``
            Contact solves that the direct solver finished (E44), and its factorisations in all of them.
        """
        self._require_steps()
        found = summary(self._world.tally)
        return found if self._certified else {name: found[name] for name in UNCERTIFIED}

    @property
    def left_out(self) -> tuple[str, ...]:
        """What the scene did not need and was therefore not modelled."""
        return self.needs.left_out()
