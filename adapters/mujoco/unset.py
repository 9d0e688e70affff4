"""MuJoCo's defaults; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial

from adapters import unset
from adapters.mujoco.releases import silence
from adapters.unset import FRICTIONS, HALF_HEIGHT, HALF_WIDTH, RADIUS, Asked, Told, Unset


def bare_model(asked: Asked) -> str:
    """One free body above a plane, in minimal MJCF."""
    size = f"{RADIUS}" if asked.shape == "ball" else f"{HALF_WIDTH} {HALF_WIDTH} {HALF_HEIGHT}"
    kind = {"ball": "sphere", "box": "box"}[asked.shape]
    option = "" if asked.gravity is None else f'<option gravity="0 0 {-asked.gravity!r}"/>'
    ground, body = [f'friction="{mu!r}"' for mu in asked.friction] if asked.friction else ["", ""]
    return (
        f'<mujoco>{option}<worldbody><geom type="plane" size="0 0 1" {ground}/>'
        f'<body pos="0 0 {asked.height!r}"><freejoint/><geom type="{kind}" size="{size}" {body}/></body>'
        "</worldbody></mujoco>"
    )


class Bare:
    """A world of `bare_model`."""

    def __init__(self, asked: Asked) -> None:
        import mujoco

        silence(mujoco)
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(bare_model(asked))
        self._data = mujoco.MjData(self._model)
        self._data.qvel[:] = (asked.along, 0.0, asked.up, 0.0, 0.0, asked.spin)
        self._lowest = asked.height - asked.gap
        self.dt = float(self._model.opt.timestep)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        self._mujoco.mj_step(self._model, self._data, nstep=steps)

    @property
    def contacts(self) -> int:
        """Contacts at the start of the last step."""
        return int(self._data.ncon)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        velocity = self._data.qvel
        gap = float(self._data.qpos[2]) - self._lowest
        return Told(gap, float(velocity[0]), float(velocity[2]), float(velocity[5]))


def _mass() -> float:
    """Mass of a box of 1 m^3 [kg]."""
    import mujoco

    xml = '<mujoco><worldbody><body><freejoint/><geom type="box" size=".5 .5 .5"/></body></worldbody></mujoco>'
    return float(mujoco.MjModel.from_xml_string(xml).body_mass[1])


def _softness() -> float:
    """Time constant of the contact of two geoms with 0.02 and 0.04 s."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="plane" size="0 0 1" solref=".02 1"/>'
        '<body pos="0 0 .09"><freejoint/><geom size=".1" solref=".04 1"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(data.contact.solref[0, 0])


_XML, _SOFT = "XML reference: geom", "modeling: solver parameters"
_OPTION, _PAIR = "XML reference: option", "modeling: contact parameters"
UNSET = (
    Unset("friction of a pair", "1", _XML, 1.0, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.9, the larger", _PAIR, 0.9, partial(unset.friction, Bare, FRICTIONS)),
    Unset("restitution of a pair", "no such number: a spring and damper, solref 0.02 1", _SOFT, None,
          partial(unset.restitution, Bare)),
    Unset("solref of 0.02 and 0.04 s [s]", "0.03, the mean", _PAIR, 0.03, _softness, 1e-9),
    Unset("no rebound below [m/s]", "no threshold", _SOFT, None),
    Unset("linear damping [1/s]", "0", "XML reference: freejoint", 0.0,
          partial(unset.damping, Bare, "along"), 1e-9),
    Unset("angular damping [1/s]", "0", "XML reference: freejoint", 0.0,
          partial(unset.damping, Bare, "spin"), 1e-9),
    Unset("limit of speed [m/s]", "none", "engine_forward.c", math.inf,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "never: the flag sleep is off", f"{_OPTION}/flag", float("inf"),
          partial(unset.sleep, Bare)),
    Unset("gap at rest [m]", "an overlap: d = 0.9 to 0.95 leaves a part of the load", _SOFT, None,
          partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", "as at rest", _SOFT, None, partial(unset.left, Bare)),
    Unset("contacts from this gap on [m]", "0: margin", _XML, 0.0, partial(unset.ahead, Bare), 1e-12),
    Unset("gravity, upwards [m/s^2]", "-9.81", _OPTION, -9.81, partial(unset.gravity, Bare), 1e-9),
    Unset("step [s]", "0.002", _OPTION, 0.002, lambda: Bare(Asked()).dt, 1e-12),
    Unset("mass of a cubic metre [kg]", "1000: density", _XML, 1000.0, _mass, 1e-6),
)  # fmt: skip
