"""MotrixSim without any settings; see `adapters.unset`."""

from __future__ import annotations

from functools import partial

from adapters import unset
from adapters.mujoco.motrixsim.shipped import ITERATIONS, SOLREF
from adapters.mujoco.motrixsim.simulation import imported
from adapters.mujoco.unset import bare_model
from adapters.unset import FRICTIONS, Asked, Told, Unset


class Bare:
    """A world of MuJoCo's bare model."""

    def __init__(self, asked: Asked) -> None:
        engine = imported()
        self._model = engine.msd.from_str(bare_model(asked)).build()
        self._data = engine.SceneData(self._model)
        self._data.set_dof_vel([asked.along, 0.0, asked.up, 0.0, 0.0, asked.spin])
        self._lowest = asked.height - asked.gap
        self.dt = float(self._model.options.timestep)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._model.step(self._data)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        velocity = self._data.dof_vel
        gap = float(self._data.dof_pos[2]) - self._lowest
        return Told(gap, float(velocity[0]), float(velocity[2]), float(velocity[5]))


_MJCF, _SOFT = "MJCF reference", "msd.ConstraintForceModel, impedance"
UNSET = (
    Unset("friction of a pair", "1: geom friction", _MJCF, 1.0, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.9, the larger", _MJCF, 0.9, partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "none: MJCF has no word for it", _MJCF, None, partial(unset.restitution, Bare)),
    Unset("time constant of a contact [s]", f"{SOLREF[0]:g}: solref", _MJCF, SOLREF[0]),
    Unset("iterations", f"{ITERATIONS}", _MJCF, ITERATIONS),
    Unset("tolerance of the solver", "1e-8; it holds 1e-4", f"{_MJCF}; msd.SimulateOption"),
    Unset("linear damping [1/s]", "0", _MJCF, 0.0, partial(unset.damping, Bare, "along"), 1e-5),
    Unset("angular damping [1/s]", "0", _MJCF, 0.0, partial(unset.damping, Bare, "spin"), 1e-5),
    Unset("gap at rest [m]", "an overlap: a part of the load yields", _SOFT, None, partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "as at rest", _SOFT, None, partial(unset.left, Bare)),
    Unset("gravity, upwards [m/s^2]", "-9.81, along z", _MJCF, -9.81, partial(unset.gravity, Bare), 1e-4),
    Unset("step [s]", "0.002: timestep", _MJCF, 0.002, lambda: Bare(Asked()).dt, 1e-9),
)  # fmt: skip
