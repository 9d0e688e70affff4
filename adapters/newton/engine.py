"""Newton's XPBD solver behind the plugin line: spatial, position-based contact, single precision.

    step:  detect  ->  v += g dt, x += v dt  ->  n sweeps: each contact takes back its overlap, friction its slip, and
           v with them  ->  rebounds, on velocities alone

Overlaps of a step's end are taken back, all contacts at once; a body gets the mean of what its contacts ask for.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, final

from adapters.engine import Declared, Engine, EngineError, EngineFacts, Quirk, Scheme, Simulation
from adapters.means import means
from adapters.needs import Needs
from adapters.newton.profiles import PROFILES, checked
from adapters.newton.simulation import NewtonSimulation, imported
from adapters.scene import Scene
from adapters.settings import checked_step
from adapters.single_precision import without_a_place


@final
class NewtonEngine(Engine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="newton",
        title="Newton (XPBD)",
        package="newton",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, forces and position, then contacts on positions", 1),
        customary_dt=1.0 / 600.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        abilities=frozenset({"surface velocity", "moving half-space", "course", "capsule", "hull"}),
        quirks=(
            Quirk(
                "restitution is ignored unless the solver is asked for it",
                "asked for where a scene has any",
                "SolverXPBD, enable_restitution",
            ),
            Quirk(
                "materials of a pair are means of two bodies' numbers",
                "numbers are chosen of which these are the pairs' own; a table without such numbers is refused",
                "xpbd/kernels.py, _solve_body_contact_positions",
            ),
            Quirk(
                "what rubs resists rolling and spinning as well, by 0.1 mm and 5 mm of the load",
                "left alone in `default` where a body has friction; not in `tuned`",
                "ModelBuilder.ShapeConfig, mu_rolling and mu_torsional",
            ),
            Quirk(
                "a body slower than 0.1 mm/s is stopped, and so is a spin below 0.1 mrad/s",
                "left alone",
                "xpbd/kernels.py, apply_body_deltas",
            ),
            Quirk(
                "two bodies with different numbers of contacts get different impulses from the one they share",
                "left alone; impulses of such a contact are a mean",
                "SolverXPBD, rigid_contact_con_weighting",
            ),
            Quirk(
                "impulses are told of positions alone",
                "where rebounds are solved as well impulses are not stated (NaN)",
                "SolverXPBD, ObservableKind.CONTACT_F; xpbd/solver_xpbd.py: rebounds come after it",
            ),
            Quirk(
                "kernels are compiled at the first steps, into Warp's own cache",
                "told to the planner, which compiles before the clock starts",
                "warp.config.kernel_cache_dir; measured: 41 s of CPU and 6 MB",
            ),
            Quirk(
                "a step costs a millisecond of launches",
                "a step is recorded once and replayed by Warp, to the same bits",
                "warp.ScopedCapture; measured: 1.2 ms and 0.03 ms",
            ),
            Quirk(
                "a body that is moved is never moved by the solver",
                "placed where its step ends before each step, with the velocity that took it there",
                "BodyFlags.KINEMATIC, copy_kinematic_body_state_kernel",
            ),
        ),
    )
    profiles = PROFILES

    def version(self) -> str:
        """Version of the installed distribution."""
        imported()  # a release that cannot be imported has no version
        return version("newton")

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse numbers that singles cannot hold, and tables that no numbers of single bodies give."""
        for coefficient in ("restitution", "friction"):
            if means(scene, coefficient) is None:
                return f"pairs: {coefficient} of a pair is the mean of two numbers here, this table has none"
        return without_a_place(scene)

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world.

        Raises
        ------
        EngineError
            For a scene that `refuses` names, a bad step or setting.
        """
        dt, chosen = checked_step(dt), checked(settings)
        reason = self.refuses(scene, "")
        if reason:
            raise EngineError(reason)
        return NewtonSimulation(scene, dt, chosen)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Nothing yet that differs from what is asked."""
        return {}

    def kernels(self) -> Path | None:
        """Warp's folder of kernels, which it keeps for each of its releases."""
        warp, _ = imported()
        warp.init()
        return Path(warp.config.kernel_cache_dir)
