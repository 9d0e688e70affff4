"""Releases of MuJoCo: changes of its Python interface, and a writer of MJCF for releases without `MjSpec`.

`Mjcf` has the few methods of ``mujoco.MjSpec`` that `adapters.mujoco.spec` calls, and writes the same model as text.
Numbers are written with all their digits, so that both ways compile to the same model, bit by bit
(``tests/adapters/test_releases.py``).
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

from adapters.engine import EngineError
from adapters.releases import Difference, Distribution, Releases, Requirement

RELEASES = Releases(
    distributions=(Distribution("mujoco", "<4.0.0"), Distribution("mujoco-core", ">=4.0.0")),
    known=">=3.0.0,<5",
    requirements=(
        Requirement("<3.1.4", "numpy<2", "built for numpy 1: with numpy 2 every element of a contact's arrays "
                                         "reads as the first one; the property check of impulses fails "
                                         "(measured with 3.0.0 to 3.1.3)"),
    ),
    differences=(
        Difference("<3.2.4", "MjSpec is missing, or takes no attributes where a body, geom or pair is added",
                   "`Mjcf` writes the model as MJCF, which gives the same model to the last bit",
                   "measured: 3.1.6 has none, 3.2.0 to 3.2.2 refuse attributes, 3.2.3 its own options, 3.2.4 "
                   "gives and takes all of them"),
        Difference("<3.2.4", "autoreset cannot be disabled: a state that is not finite is reset",
                   "the counters of bad states are read after every step; a bad state ends the run",
                   "measured: mjtDisableBit.mjDSBL_AUTORESET is there from 3.2.4 on"),
        Difference("<3.5.0", "a contact's margin is the larger of its geoms', not their sum",
                   "a geom gets the whole margin there, and half of it where margins are added",
                   "change log of 3.5.0, item 12"),
        Difference("<3.1.3", "contact.geom holds floating-point numbers", "they are turned into integers",
                   "measured: 3.1.2 float64, 3.1.3 int32"),
        Difference("<3.10.0", "there is no MjLogConfig: warnings cannot be switched off",
                   "an unstable run may write a file MUJOCO_LOG.TXT",
                   "measured: 3.3.7 has none, 3.10.0 has it"),
        Difference("==3.9.0", "a step ends with an error where the box-box collider, given a margin, returns 9 "
                   "contacts of the 8 that are announced",
                   "such cases crash with MuJoCo's own message; another margin would be another profile than in other "
                   "releases",
                   "measured: with margin 0 the same stacks of 10 and 20 run through; 3.8.1 and 3.10.0 do with it"),
        Difference(">=4.0.0", "the bindings moved from the distribution mujoco to mujoco-core",
                   "both are this engine; mujoco 4.0.0 itself has only tools on top of mujoco-core",
                   "metadata of mujoco 4.0.0"),
    ),
)  # fmt: skip


def empty_spec(mujoco: Any) -> Any:
    """An empty ``MjSpec``, or its replacement in releases whose own does not support the adapter's calls."""
    try:
        spec = mujoco.MjSpec()
        spec.worldbody.add_body(name="asked")
        spec.option  # noqa: B018 - 3.2.3 has it and cannot give it away
    except (AttributeError, TypeError):
        return Mjcf(mujoco)
    return mujoco.MjSpec()


def no_autoreset(mujoco: Any) -> int:
    """Bit that disables autoreset; 0 where there is none (see `check_state`)."""
    return int(getattr(mujoco.mjtDisableBit, "mjDSBL_AUTORESET", 0))


def check_state(mujoco: Any, data: Any) -> None:
    """Refuse to continue from a state that was reset because it was not finite.

    Raises
    ------
    EngineError
        If autoreset cannot be disabled in this release, and has acted.
    """
    if no_autoreset(mujoco):
        return
    kinds = mujoco.mjtWarning
    for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
        if data.warning[kind].number:
            raise EngineError(f"state: MuJoCo has reset a state that was not finite ({kind.name})")


def geom_margin(mujoco: Any, margin: float) -> float:
    """Margin of a geom so that two of them give a contact's ``margin`` [m]."""
    return margin if _older(mujoco, 3, 5) else 0.5 * margin


def _older(mujoco: Any, major: int, minor: int) -> bool:
    found = [int(part) for part in str(mujoco.__version__).split(".")[:2]]
    return found < [major, minor]


def silence(mujoco: Any) -> None:
    """Switch the log off, where a release allows it."""
    if hasattr(mujoco, "MjLogConfig"):
        log = mujoco.MjLogConfig.get()
        log.logto_file = log.logto_console = False
        log.set()


class Mjcf:
    """Writes MJCF through the part of ``MjSpec``'s interface that the adapter uses."""

    def __init__(self, mujoco: Any) -> None:
        self._mujoco = mujoco
        self.option = SimpleNamespace()
        self._root = ElementTree.Element("mujoco")
        self.worldbody = _Body(mujoco, ElementTree.Element("worldbody"))
        self.contact = ElementTree.Element("contact")
        self._actuator = ElementTree.Element("actuator")
        self._meshes: list[ElementTree.Element] = []
        self._keys: list[ElementTree.Element] = []

    def add_pair(self, *, geomname1: str, geomname2: str, **attributes: Any) -> None:
        """Add a pair of geoms by their names."""
        given = {"geom1": geomname1, "geom2": geomname2, **attributes}
        ElementTree.SubElement(self.contact, "pair", _text(given))

    def add_load(self, name: str, wrench: tuple[float, ...]) -> None:
        """Push a free body with a constant force and torque, (6,) world axes [N, N m].

        An actuator without gain whose bias is 1, so its gear is the force. ``jointinparent`` means world axes.
        """
        joint = self.worldbody.element.find(f"body[@name='{name}']/freejoint")
        assert joint is not None
        joint.set("name", f"{name} joint")
        law = {"gaintype": "fixed", "gainprm": "0", "biastype": "affine", "biasprm": "1 0 0"}
        given = {"name": f"{name} load", "jointinparent": f"{name} joint", "gear": _written(wrench), **law}
        ElementTree.SubElement(self._actuator, "general", given)

    def add_key(self, **attributes: Any) -> None:
        """Add a start state."""
        self._keys.append(ElementTree.Element("key", _text(attributes)))

    def add_mesh(self, *, name: str, uservert: list[float]) -> None:
        """Add a mesh by its corners, whose hull collides."""
        self._meshes.append(ElementTree.Element("mesh", {"name": name, "vertex": _written(uservert)}))

    def compile(self) -> Any:
        """Return the compiled ``MjModel``; raises ValueError as MuJoCo does."""
        return self._mujoco.MjModel.from_xml_string(self.text())

    def text(self) -> str:
        """The model as MJCF, to be called once."""
        ElementTree.SubElement(self._root, "compiler", {"angle": "radian"})
        said = dict(vars(self.option))
        mj = self._mujoco
        flags, enabled = int(said.pop("disableflags", 0)), int(said.pop("enableflags", 0))
        said["integrator"] = mj.mjtIntegrator(said["integrator"]).name.removeprefix("mjINT_")
        said["integrator"] = {"EULER": "Euler", "RK4": "RK4"}.get(said["integrator"], said["integrator"].lower())
        said["cone"] = mj.mjtCone(said["cone"]).name.removeprefix("mjCONE_").lower()
        if "jacobian" in said:
            said["jacobian"] = mj.mjtJacobian(said["jacobian"]).name.removeprefix("mjJAC_").lower()
        if "solver" in said:
            solver = mj.mjtSolver(said["solver"]).name.removeprefix("mjSOL_")
            said["solver"] = {"NEWTON": "Newton"}.get(solver, solver)
        option = ElementTree.SubElement(self._root, "option", _text(said))
        members = mj.mjtDisableBit.__members__.values()  # one of them is their count
        off = [bit.name for bit in members if int(bit).bit_count() == 1 and int(bit) & flags]
        on = [bit.name for bit in mj.mjtEnableBit.__members__.values() if int(bit) & enabled]
        if off or on:
            said = {name.removeprefix("mjDSBL_").lower(): "disable" for name in off}
            said |= {name.removeprefix("mjENBL_").lower(): "enable" for name in on}
            ElementTree.SubElement(option, "flag", said)
        if self._meshes:
            ElementTree.SubElement(self._root, "asset").extend(self._meshes)
        self.worldbody.finish()
        self._root.append(self.worldbody.element)
        if len(self.contact):
            self._root.append(self.contact)
        if len(self._actuator):
            self._root.append(self._actuator)
        if self._keys:
            ElementTree.SubElement(self._root, "keyframe").extend(self._keys)
        ElementTree.indent(self._root)
        return ElementTree.tostring(self._root, encoding="unicode") + "\n"


class _Body:
    """A body; its inertial is written when the spec is compiled, from attributes of ``MjsBody``'s names."""

    def __init__(self, mujoco: Any, element: ElementTree.Element) -> None:
        self._mujoco, self.element = mujoco, element
        self._children: list[_Body] = []
        self.explicitinertial = False
        self.mass, self.gravcomp = 0.0, 0.0
        self.ipos: Any = (0.0, 0.0, 0.0)
        self.iquat: Any = (1.0, 0.0, 0.0, 0.0)
        self.inertia: Any = (0.0, 0.0, 0.0)

    def add_body(self, **attributes: Any) -> _Body:
        """Add a child body."""
        made = _Body(self._mujoco, ElementTree.SubElement(self.element, "body", _text(attributes)))
        self._children.append(made)
        return made

    def add_freejoint(self) -> None:
        """Let it move freely."""
        ElementTree.SubElement(self.element, "freejoint")

    def add_geom(self, *, type: Any, **attributes: Any) -> None:
        """Add a geom."""
        kind = self._mujoco.mjtGeom(type).name.removeprefix("mjGEOM_").lower()
        if "meshname" in attributes:
            attributes["mesh"] = attributes.pop("meshname")
        ElementTree.SubElement(self.element, "geom", {"type": kind, **_text(attributes)})

    def finish(self) -> None:
        """Write what was set as attributes."""
        if self.explicitinertial:
            given = {"pos": self.ipos, "quat": self.iquat, "mass": self.mass, "diaginertia": self.inertia}
            self.element.insert(0, ElementTree.Element("inertial", _text(given)))
        if self.gravcomp:
            self.element.set("gravcomp", repr(float(self.gravcomp)))
        for child in self._children:
            child.finish()


def _text(attributes: dict[str, Any]) -> dict[str, str]:
    """Attributes as MJCF writes them, with all digits of every number."""
    return {name: _written(value) for name, value in attributes.items()}


def _written(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    return " ".join(_written(float(item)) for item in value)
