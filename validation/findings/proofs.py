"""Proofs of families: ``[[family.proof]]`` under a family of ``families.toml``.

    cell      the failing row: profile, dimension, metric; params, iterations and dt where they are not those of the
              scene, the profile and the quick suite
    set       settings that switch the mechanism off
    not       settings of other explanations, each of which alone must not help; optional
    within    distance from the truth that counts as a PASS, in the metric's unit; optional

`adapters.experiment.Experiment` defines each of them, `validation.settings.proofs` runs them.
"""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment
from adapters.experiment.files import (
    DIMENSION,
    NAME,
    TABLE,
    Fields,
    checked,
    is_list_of,
    is_number,
    is_numbers,
    is_word,
    params_of,
    settings_of,
)
from adapters.scene import SceneError
from validation.cells import parse_dt
from validation.findings import Family


def _is_settings(value: Any) -> bool:
    return isinstance(value, dict) and bool(value)


_CELL: Fields = {
    "profile": NAME,
    "dimension": DIMENSION,
    "metric": NAME,
    "params": (is_numbers, "a table of numbers"),
    "iterations": (lambda value: type(value) is int and value > 0, "a whole number above 0"),
    "dt": (is_word, 'a step in words, "1/480"'),
}
_PROOF: Fields = {
    "cell": TABLE,
    "set": (_is_settings, "a table of settings"),
    "not": (is_list_of(_is_settings), "a list of tables of settings"),
    "within": (lambda value: is_number(value) and value > 0, "a number above 0"),
}


def proof_of(family: Family, entry: Any) -> Experiment:
    """Read one proof of a family.

    Raises
    ------
    ValueError
        Naming the field, in one line.
    """
    proof = checked("proof", entry, _PROOF, ("cell", "set"))
    cell = checked("proof: cell", proof["cell"], _CELL, ("profile", "dimension", "metric"))
    if not family.covers((cell["profile"], family.scene, "", "", "", "", cell["metric"])):
        raise ValueError(f"proof: cell: the family does not cover {cell['profile']} {cell['metric']}")
    off, idle = settings_of(proof["set"]), tuple(map(settings_of, proof.get("not", [])))
    if off in idle:
        raise ValueError("proof: not: the same settings as in set")
    try:
        dt = parse_dt(cell["dt"]) if "dt" in cell else None
    except SceneError as error:
        raise ValueError(f"proof: cell: {error}") from None
    return Experiment(
        family.id, family.reason, cell["profile"], family.scene, cell["metric"], off, params_of(cell.get("params", {})),
        cell["dimension"], cell.get("iterations"), idle, float(proof.get("within", 0.0)), dt,
    )  # fmt: skip
