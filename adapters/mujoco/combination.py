"""MuJoCo's combination of two geoms' contact parameters.

[MuJoCo documentation: computation/contact parameters] The geom of higher ``priority`` alone counts. Otherwise the
dimension and the coefficients of friction are the larger ones; ``solref`` and ``solimp`` are weighted by ``solmix``
(``solref`` in the direct format: the smaller ones); margins add up. A stated pair overrides both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

#: Weights, masses and moments below this count as none (mjMINVAL).
MINVAL = 1e-15

Row = tuple[float, ...]


@dataclass(frozen=True)
class Contact:
    """One pair of geoms.

    Parameters
    ----------
    condim
        Dimension: 1 normal, 3 with sliding friction, 4 torsional, 6 rolling.
    friction
        Sliding coefficient; 0 where the dimension is 1.
    softness
        ``solref``, ``solimp``, ``solreffriction`` (None: as ``solref``), ``margin`` [m].
    refusal
        What a scene cannot express; empty if it can.
    """

    condim: int
    friction: float
    softness: tuple[Row, Row, Row | None, float]
    refusal: str


def contact_of(model: Any, a: int, b: int, pair: int | None) -> Contact:
    """Contact of geoms ``a`` and ``b``, or of the stated ``pair``."""
    if pair is not None:
        m = model
        friction, gap = np.array(m.pair_friction[pair]), float(m.pair_gap[pair])
        soft = (m.pair_solref[pair], m.pair_solimp[pair], m.pair_solreffriction[pair], m.pair_margin[pair])
        return _contact(int(m.pair_dim[pair]), friction, gap, *soft)
    condim, friction, solref, solimp = _combined(model, a, b)
    margin, gap = (float(field[a] + field[b]) for field in (model.geom_margin, model.geom_gap))
    full = np.array([friction[0], friction[0], friction[1], friction[2], friction[2]])
    return _contact(condim, full, gap, solref, solimp, np.zeros(2), margin, _moves_along(model, a, b))


def _combined(model: Any, a: int, b: int) -> tuple[int, Any, Any, Any]:
    fields = [
        (int(model.geom_condim[g]), np.array(model.geom_friction[g]), np.array(model.geom_solref[g]),
         np.array(model.geom_solimp[g]))
        for g in (a, b)
    ]  # fmt: skip
    first, second = int(model.geom_priority[a]), int(model.geom_priority[b])
    if first != second:
        return fields[0] if first > second else fields[1]
    weights = float(model.geom_solmix[a]), float(model.geom_solmix[b])
    mix = _share(*weights)
    (condim, friction, solref, solimp), (other_condim, other_friction, other_solref, other_solimp) = fields
    direct = solref[0] <= 0.0 or other_solref[0] <= 0.0
    return (
        max(condim, other_condim),
        np.maximum(friction, other_friction),
        np.minimum(solref, other_solref) if direct else mix * solref + (1.0 - mix) * other_solref,
        mix * solimp + (1.0 - mix) * other_solimp,
    )


def _share(first: float, second: float) -> float:
    """Weight of the first of two geoms."""
    if first >= MINVAL and second >= MINVAL:
        return first / (first + second)
    if first < MINVAL and second < MINVAL:
        return 0.5
    return 0.0 if first < MINVAL else 1.0


def _moves_along(model: Any, a: int, b: int) -> str:
    """Contact parameters of newer releases that no scene has."""
    for name in ("geom_surfacevel", "geom_adhesion"):
        values = getattr(model, name, None)
        if values is not None and (np.any(values[a]) or np.any(values[b])):
            return f"{name.removeprefix('geom_')}: a scene's surfaces have no motion or adhesion of this kind"
    return ""


def _contact(
    condim: int,
    friction: Any,
    gap: float,
    solref: Any,
    solimp: Any,
    solreffriction: Any,
    margin: Any,
    refusal: str = "",
) -> Contact:
    if condim >= 3 and friction[0] != friction[1]:
        refusal = "friction differs by direction; a scene's is the same in all"
    elif condim >= 4 and friction[2] > 0.0:
        refusal = f"condim {condim}: a scene has no torsional friction"
    elif condim >= 6 and max(friction[3], friction[4]) > 0.0:
        refusal = f"condim {condim}: a scene has no rolling friction"
    elif gap:
        refusal = "gap: a scene's contacts act where they are found"
    rows = tuple(float(x) for x in solref), tuple(float(x) for x in solimp)
    sliding = tuple(float(x) for x in solreffriction) if np.any(solreffriction) else None
    return Contact(min(condim, 3), float(friction[0]) if condim >= 3 else 0.0, (*rows, sliding, float(margin)), refusal)
