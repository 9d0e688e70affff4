"""``findings --prove ID``: runs and shows the experiments that test a stated cause."""

from __future__ import annotations

import difflib
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import click
from rich.text import Text

from adapters import registry
from adapters.experiment import Experiment
from reports.terminal import terminal
from reports.wording import number, params_text, quantity, reproduce
from validation.cells import slot_from_dict
from validation.findings import FindingsError, row_key
from validation.findings.files import findings_of
from validation.settings.proofs import Proof, experiments_on, prove
from validation.settings.switching import Reading

#: Largest number of similar names for a mistyped one; a list of hundreds would not help.
NEAREST = 3


def chosen(reason: str, engines: Sequence[str]) -> dict[str, list[Experiment]]:
    """Experiments of a cause (``all``: of every cause) by engine.

    Raises
    ------
    FindingsError
        If no selected engine has such a cause, or it has no experiment.
    """
    found: dict[str, list[Experiment]] = {}
    families: list[str] = []
    for engine in engines or registry.usual():
        known = findings_of(engine)
        families += list(known.families) if known else []
        wanted = [e for e in experiments_on(engine) if reason in ("all", e.family)]
        if wanted and (reason == "all" or (known and reason in known.families)):
            found[engine] = wanted
    if not found and reason in families:
        raise FindingsError(f"prove: the cause {reason!r} has no experiment (in families.toml of its engine)")
    if not found:
        close = ", ".join(map(repr, difflib.get_close_matches(reason, dict.fromkeys(families), n=NEAREST, cutoff=0.5)))
        hint = f"did you mean {close}?" if close else "crosscheck explain names that of a known failure"
        raise FindingsError(f"prove: none of {len(families)} causes is called {reason!r}; {hint}")
    return found


def proof_of(row: Mapping[str, Any]) -> str:
    """The command that tests the cause of a row that is on record; empty where the cause has no experiment."""
    known = findings_of(row["engine"])
    member = known.members.get(row_key(slot_from_dict(row["slot"]), row["metric"])) if known else None
    if member is None or member.family.id not in {each.family for each in experiments_on(row["engine"])}:
        return ""
    return f"crosscheck findings --prove {member.family.id}"


def prove_and_show(reason: str, engines: Sequence[str], as_json: bool) -> None:
    """Run the experiments, print their results, and exit with 1 unless all confirm their causes."""
    console = terminal()
    proofs: list[Proof] = []
    for engine, experiments in chosen(reason, engines).items():
        with terminal(stderr=True).status(Text(f"{engine}: {len(experiments)} experiments")):
            proofs += prove(engine, experiments)
    if as_json:
        click.echo(json.dumps([_plain(proof) for proof in proofs], indent=1))
    else:
        for proof in proofs:
            for line in lines(proof):
                console.print(line, soft_wrap=True)
        held = sum(proof.holds for proof in proofs)
        console.print(Text(f"{held} of {len(proofs)} experiments confirm their cause"))
    sys.exit(0 if all(proof.holds for proof in proofs) else 1)


def lines(proof: Proof) -> list[Text]:
    """One experiment as text: its cause, the check before and after, changes without effect, the command to run it."""
    slot, experiment = proof.before.slot, proof.experiment
    where = f"{proof.engine}/{slot.profile} {slot.scene} {slot.dimension}-D {params_text(dict(slot.params))}".strip()
    where += f" at {slot.iterations} iterations" if slot.iterations is not None else ""
    mark = "PROVEN" if proof.holds else "NOT PROVEN"
    found = [Text(f"{mark}  {experiment.family}: {experiment.says}"), Text(f"  {where}: {_value(proof.before)}")]
    found.append(Text(f"    with {_changes(experiment.off)}: {_value(proof.after)}"))
    for change, each in zip(experiment.idle, proof.idle, strict=True):
        found.append(Text(f"    with {_changes(change)} alone: {_value(each)}"))
    if not proof.holds:
        found.append(Text(f"    {proof.why_not}"))
    found.append(Text(f"    {reproduce(slot.as_dict())}"))
    return found


def _changes(changes: Any) -> str:
    return ", ".join(f"{name} = {value}" for name, value in changes.items())


def _value(found: Reading) -> str:
    if found.value is None:
        return f"no {found.check.metric}: {found.reason}"
    mark = "PASS" if found.badness <= 1.0 else "FAIL"
    check = found.check
    text = f"{quantity(found.value, check.unit, 6)} of {number(check.truth)} +- {number(check.bound)}"
    return f"{mark} {check.metric} {text}"


def _plain(proof: Proof) -> dict[str, Any]:
    def row(found: Reading) -> dict[str, Any]:
        return {"slot": found.slot.as_dict(), "value": found.value, "reason": found.reason, **asdict(found.check)}

    return {
        "engine": proof.engine,
        "family": proof.experiment.family,
        "says": proof.experiment.says,
        "holds": proof.holds,
        "why_not": proof.why_not,
        "before": row(proof.before),
        "after": row(proof.after),
        "idle": [row(each) for each in proof.idle],
    }
