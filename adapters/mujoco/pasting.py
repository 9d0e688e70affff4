"""Settings of MuJoCo as MJCF for pasting, with formulas of numbers that depend on e, the step or gravity."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from adapters.mujoco.pairs import pair_solref, pair_solreffriction
from adapters.needs import needs
from adapters.scene import HalfSpace, Scene

#: Settings that are attributes of MJCF's ``<option>``, by the same name.
OPTIONS = ("integrator", "cone", "impratio", "iterations", "tolerance", "noslip_iterations")
#: MuJoCo's torsional and rolling friction of a pair, which our materials do not have.
TURNING = (0.005, 0.0001, 0.0001)
#: Class of geoms without friction.
SMOOTH = "smooth"
#: Number of pairs of bodies that a comment names; others are counted.
NAMED = 3

#: Restitution and friction of a pair.
Material = tuple[float, float]
#: Value of an attribute and its formula; empty for a constant.
Told = tuple[Any, str]


def words(settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
    """See `adapters.engine.Engine.words`."""
    found: dict[str, tuple[str, Any]] = {"kappa_elastic": ("", 0.0), "kappa_plastic": ("", 0.0)}
    if "smooth_condim" in settings:
        condim = settings["smooth_condim"]
        found["smooth_condim"] = ("condim", "1 of pairs without friction" if condim == 1 else condim)
    if settings.get("solref") == "reflect":
        said = {_solref_formula(settings, e): "e > 0" if e > 0.0 else "e = 0" for e, _ in sorted(scene.materials())}
        texts = [f"{formula} where {where}" if len(said) > 1 else formula for formula, where in said.items()]
        found["solref"] = ("solref", ", ".join(texts) or "nothing touches")
    if settings.get("solreffriction", ()) in (None, "stick"):
        found["solreffriction"] = ("solreffriction", "0 -1/dt" if settings["solreffriction"] else "as solref")
    if "margin" in settings:
        formula = _margin_formula(settings["margin"], scene, dt)
        found["margin"] = ("margin", formula or settings["margin"])
    return found


def snippet(settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
    """See `adapters.engine.Engine.snippet`.

    A class of geoms where all pairs of the scene are alike: nothing else changes. Else one
    ``<pair>`` for each material, with its friction, for each pair of geoms.
    """
    pairs: dict[Material, list[str]] = {}
    for i, j, material in scene.contact_pairs():
        between = f"{scene.bodies[i].name}-{scene.bodies[j].name}"
        if not all(isinstance(scene.bodies[k].shape, HalfSpace) for k in (i, j)):
            pairs.setdefault((material.restitution, material.friction), []).append(between)
    option = {name: (settings[name], "") for name in OPTIONS if name in names}
    asked = {material: _of_pair(settings, names, material, scene, dt) for material in pairs}
    shared = len({str(told) for told in asked.values()}) == 1 and "solreffriction" not in names
    lines: list[str] = []
    if any(asked.values()):
        lines = _of_all(pairs, asked, scene, dt) if shared else _of_pairs(pairs, asked, scene, dt)
    return "\n".join([*([_element("option", option)] if option else []), *lines])


def _of_pair(
    settings: Mapping[str, Any], names: Collection[str], material: Material, scene: Scene, dt: float
) -> dict[str, Told]:
    """Attributes in ``names`` of a pair of this material."""
    restitution, friction = material
    found: dict[str, Told] = {}
    if {"solref", "kappa_elastic", "kappa_plastic"} & set(names):
        formula = _solref_formula(settings, restitution) if settings["solref"] == "reflect" else ""
        found["solref"] = (pair_solref(settings, restitution, dt), formula)
    if "solimp" in names:
        found["solimp"] = (settings["solimp"], "")
    if "smooth_condim" in names and friction == 0.0:
        found["condim"] = (settings["smooth_condim"], "")
    if "margin" in names:
        found["margin"] = (settings["margin"], _margin_formula(settings["margin"], scene, dt))
    if "solreffriction" in names and friction > 0.0:
        formula = "0 -1/dt" if settings["solreffriction"] == "stick" else ""
        found["solreffriction"] = (pair_solreffriction(settings, dt), formula)
    return found


def _of_all(
    pairs: Mapping[Material, Sequence[str]], asked: Mapping[Material, Mapping[str, Told]], scene: Scene, dt: float
) -> list[str]:
    """A class of geoms with priority over those without, and the same for explicit pairs.

    With equal priority MuJoCo would mix the values of both geoms, and take the larger ``condim``. One that takes all
    friction is a class of its own, within the other, so that a geom that rebounds need not lose its friction.
    """
    pair = dict(next(iter(asked.values())))
    smooth = {"condim": pair.pop("condim")} if pair.get("condim", (3, ""))[0] == 1 else {}
    bounces = {restitution for restitution, _ in pairs} if "solref" in pair else set()
    name, which = ("rebounds", "rebound") if any(e > 0.0 for e, _ in pairs) else ("rests", "rest, slide or roll")
    lines: list[str] = []
    if smooth:
        instead = "instead " if pair else ""
        said = f'give class="{SMOOTH}" {instead}only to geoms without friction: condim="1" takes all of it from them'
        lines = _class(SMOOTH, [said], [], {**({} if pair else {"priority": (1, "")}), **smooth}, smooth)
    if pair:
        said = f'give class="{name}" to geoms that {which}; their values count, friction too, not the other geom\'s'
        of_geoms, of_pairs = [said, *_holds(pair, bounces, scene, dt)], _formulas(pair, bounces)
        lines = _class(name, of_geoms, of_pairs, {"priority": (1, ""), **pair}, pair, lines)
    return ["<default>", *lines, "</default>"]


def _class(
    name: str,
    of_geoms: Sequence[str],
    of_pairs: Sequence[str],
    geom: Mapping[str, Told],
    pair: Mapping[str, Told],
    within: Sequence[str] = (),
) -> list[str]:
    """A default class with comments for geoms and explicit pairs; ``within``: lines of a class that has its values."""
    same = _comment(["the same for explicit pairs, which take nothing from geoms", *of_pairs])
    own = (_comment(of_geoms), _element("geom", geom), same, _element("pair", pair))
    lines = [*(f"    {line}" for line in own), *(f"  {line}" for line in within)]
    return [f'  <default class="{name}">', *lines, "  </default>"]


def _of_pairs(
    pairs: Mapping[Material, Sequence[str]], asked: Mapping[Material, Mapping[str, Told]], scene: Scene, dt: float
) -> list[str]:
    """One pair for each material, with a comment on the pairs of bodies; a pair takes no friction from its geoms."""
    lines = ["<contact>", "  <!-- a line for each pair of geoms that may touch, with their names for A and B -->"]
    for material, told in asked.items():
        if not told:
            continue
        restitution, friction = material
        between = ", ".join(pairs[material][:NAMED])
        rest = len(pairs[material]) - NAMED
        said = f"e = {restitution:g}, friction {friction:g}: {between}{f' and {rest} more' if rest > 0 else ''}"
        bounces = {restitution} if "solref" in told else set()
        names: dict[str, Told] = {"geom1": ("A", ""), "geom2": ("B", "")}
        names["friction"] = ((friction, friction, *TURNING), "")
        comment = _comment([said, *_holds(told, bounces, scene, dt)])
        lines += [f"  {comment}", f"  {_element('pair', {**names, **told})}"]
    return [*lines, "</contact>"]


def _solref_formula(settings: Mapping[str, Any], restitution: float) -> str:
    """`pair_solref` of "reflect" as text."""
    kappa = settings["kappa_elastic" if restitution > 0.0 else "kappa_plastic"]
    return f"{f'-{kappa:g}/dt^2' if kappa else '0'} {'-(1+e)/dt' if restitution > 0.0 else '-1/dt'}"


def _margin_formula(margin: float, scene: Scene, dt: float) -> str:
    """The margin as a multiple of one step's fall, ``g dt^2``, where it is a round one; else empty.

    Round to four digits: the profiles use a thousandth of it, and a user's margin is not round to 1e-9.
    """
    fall = needs(scene).pull * dt**2
    share = margin / fall if fall else 0.0
    return f"{share:.4g}*g*dt^2" if share and abs(float(f"{share:.4g}") / share - 1.0) < 1e-9 else ""


def _formulas(told: Mapping[str, Told], bounces: Collection[float]) -> list[str]:
    """Attributes with formulas instead of numbers; empty where all are constants."""
    formulas = " ".join(f'{name}="{formula}"' for name, (_, formula) in told.items() if formula)
    which = f" with e {'>' if max(bounces) > 0.0 else '='} 0" if bounces else ""
    return [f"for others{which}: {formulas}"] if formulas else []


def _holds(told: Mapping[str, Told], bounces: Collection[float], scene: Scene, dt: float) -> list[str]:
    """The e, step and gravity of the numbers, and formulas for others; empty where all are constants."""
    formulas = _formulas(told, bounces)
    if not formulas:
        return []
    e = max(bounces, default=0.0)
    known = {"1+e": f"e = {e:g}", "dt": f"dt = {dt:.9g} s", "g*": f"g = {needs(scene).pull:.9g} m/s^2"}
    return [f"the numbers are for {', '.join(text for name, text in known.items() if name in formulas[0])}", *formulas]


def _comment(said: Sequence[str]) -> str:
    """An XML comment, one line for each text."""
    text = ";\n       ".join(said).replace("--", "- -")
    return f"<!-- {text} -->"


def _element(name: str, attributes: Mapping[str, Told]) -> str:
    """One empty MJCF element; numbers keep all digits that matter in a step."""

    def text(value: Any) -> str:
        if isinstance(value, tuple | list):
            return " ".join(text(item) for item in value)
        return f"{value + 0.0:.9g}" if isinstance(value, float) else str(value)

    return f"<{name} " + " ".join(f'{key}="{text(value)}"' for key, (value, _) in attributes.items()) + "/>"
