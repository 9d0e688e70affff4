"""MuJoCo Warp (`mujoco-warp`): MuJoCo in Warp's kernels, single precision; here on the CPU."""

from __future__ import annotations

from typing import Any, final

from adapters.engine import EngineError, Expected, Quirk
from adapters.isolation.quiet import quiet
from adapters.mujoco.port import PortEngine, PortSimulation, port_facts
from adapters.mujoco.releases import no_autoreset

MEASURED = (
    "measured with 3.17.0: a ball falling on a floor of friction 0 to 1e-3; none with 0.01, condim=1 or elliptic cones"
)
#: Contacts that fit per body: four neighbours with eight each.
CONTACTS = 32


def imported() -> tuple[Any, Any]:
    """Import Warp, which then reports errors only, and the port."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    with quiet():  # about a missing GPU
        warp.init()
    import mujoco_warp

    return warp, mujoco_warp


class WarpSimulation(PortSimulation):
    """One model of MuJoCo Warp on the CPU."""

    def _put(self) -> None:
        self._warp, self._port = imported()
        self._recorded: Any = None
        self._model.opt.disableflags &= ~no_autoreset(self._mujoco)
        most = CONTACTS * self._model.ngeom
        with self._warp.ScopedDevice("cpu"):
            self._ported = self._port.put_model(self._model)
            self._state = self._port.put_data(self._model, self._data, nconmax=most, njmax=4 * most)

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps.

        Raises
        ------
        EngineError
            If contacts do not fit into its memory.
        """
        state = self._state
        with self._warp.ScopedDevice("cpu"):
            for _ in range(steps):
                if self._recorded is None:
                    self._ported.opt.warn_overflow = 0  # which kernels print; what is dropped is found below
                    self._step()  # compiles what is recorded afterwards
                    with self._warp.ScopedCapture(device="cpu") as made:
                        self._step()
                    self._recorded = made.graph
                else:
                    self._warp.capture_launch(self._recorded)
        self._data.qpos[:], self._data.qvel[:] = state.qpos.numpy()[0], state.qvel.numpy()[0]
        if state.nacon.numpy()[0] > state.naconmax or state.nefc.numpy()[0] > state.njmax:
            raise EngineError("memory: contacts do not fit, so some were dropped")

    def _step(self) -> None:
        self._port.step(self._ported, self._state)

    def _copy(self) -> None:
        self._port.get_data_into(self._data, self._model, self._state)

    def _tolerance(self) -> float:
        return float(self._ported.opt.tolerance.numpy()[0])


#: Why a body that strikes another without friction may have no state afterwards.
NO_NUMBER = (
    "in single precision the edges of a friction pyramid of 1e-3 or less are alike, so a blow along the normal may "
    "not be a number; a pair without friction keeps one of 1e-5"
)
#: Checks in which a body strikes another without friction, with the profile as shipped.
STRUCK = ("capabilities", "fresh", "sizes", "receipt size", "receipt restitution", "receipt impulse", "receipt turn")


@final
class MujocoWarpEngine(PortEngine):
    """Adapter of MuJoCo Warp."""

    facts = port_facts(
        "mujoco_warp",
        "MuJoCo Warp",
        "mujoco-warp",
        "single",
        Quirk(
            "the tolerance of the solver is at least 1e-6",
            "unchanged; the readback has the value that is used",
            "mujoco_warp/_src/io.py, put_model",
        ),
        Quirk(NO_NUMBER, "unchanged; smooth_condim=1 or cone=elliptic avoid it", MEASURED),
        Quirk(
            "places are rounded by more than the margin with which `tuned` keeps touching bodies in contact",
            "unchanged; with margin=0.001 piles move as in C",
            "measured: stack, shove",
        ),
        Quirk(
            "it takes no flag to disable autoreset, and resets nothing",
            "the flag is left out",
            "mujoco_warp/_src/io.py, put_model",
        ),
        Quirk(
            "contacts beyond the memory that is asked for are dropped",
            f"memory for {CONTACTS} contacts per body; a run that needs more fails",
            "mujoco_warp/_src/io.py, put_data: nconmax, njmax",
        ),
        Quirk(
            "launching the kernels of a step takes 6 ms",
            "Warp records a step once and replays it, bit for bit",
            "warp.ScopedCapture; measured: 0.1 ms",
        ),
        Quirk(
            "kernels are compiled at the first steps, into Warp's own cache",
            "unchanged",
            "warp.config.kernel_cache_dir",
        ),
    )
    module = "mujoco_warp"
    simulation = WarpSimulation
    expected = (
        Expected("readback", "the tolerance of the solver is at least 1e-6", "mujoco_warp/_src/io.py, put_model"),
        *(Expected(check, NO_NUMBER, MEASURED) for check in STRUCK),
    )
