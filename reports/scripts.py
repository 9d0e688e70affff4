"""A case as a script that needs only its engine, for a bug report: the case and its truth, then the run itself.

The run is written by the engine's own folder (`adapters.engine.Engine.exports`).
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator

from adapters.engine import EngineError
from adapters.plain import lines, one_line
from adapters.registry import load
from adapters.scene import SceneError
from adapters.stepping import posed_for, step_count
from reports.wording import profile_words, quantity
from validation.cells import Slot, format_dt, prepare, settings_of

#: Largest number of checks in a script; a column of twenty has hundreds.
MOST_CHECKS = 12
#: Longest line of the head [characters].
WIDTH = 200


def written(slot: Slot, form: str) -> str:
    """The run of ``slot`` in ``form``, one of the formats that its engine writes.

    Raises
    ------
    EngineError, SceneError
        If the engine is missing, refuses the scene, or has no such format; or if the slot is wrong.
    """
    engine, prepared = load(slot.engine), prepare(slot)
    write = engine.exports.get(form)
    if write is None:
        known = ", ".join(engine.exports) or "nothing"
        raise SceneError(f"to: {slot.engine} writes {known}, not {one_line(form, 20)}")
    posed = posed_for(engine, prepared.scene)
    refusal = engine.refuses(posed, slot.base)
    if refusal:
        raise EngineError(f"{slot.engine} refuses this scene: {refusal}")
    settings = {setting.name: setting.value for setting in settings_of(engine, slot, prepared.scene)}
    engine.check_settings(settings)
    text = write(posed, slot.dt, settings, step_count(prepared.scene.duration, slot.dt))
    head = [lines(line, 1, WIDTH) for line in _head(slot)]
    if posed.dimension != prepared.scene.dimension:
        head.append("A planar scene, posed in the plane y = 0 of space.")
    if text.lstrip().startswith("<"):
        said = re.sub("-(?=-)", "- ", "\n".join(f"  {line}".rstrip() for line in head))  # two would end a comment
        return f"<!--\n{said}\n-->\n{text}"
    return "".join(f"# {line}".rstrip() + "\n" for line in head) + "\n" + text


def imported(text: str) -> set[str]:
    """Names of the modules imported by a script: a file of that name would be imported instead."""
    return set(re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE))


def _head(slot: Slot) -> Iterator[str]:
    """The information for a reader who does not know the project."""
    prepared = prepare(slot)
    canonical = prepared.canonical
    asked = " ".join([canonical.name, slot.params_text()]).strip()
    yield f"{canonical.title} ({asked}, {slot.dimension}-D) on {slot.engine} {prepared.cell.engine_version},"
    yield f"settings of contact-crosscheck's profile {slot.profile}, step {format_dt(slot.dt)} s; SI units."
    yield from canonical.figure.splitlines()
    yield f"True: {canonical.law}"
    checks = [c for c in canonical.checks(prepared.scene, slot.dt) if c.truth is not None]
    because = ""
    for check in checks[:MOST_CHECKS]:
        within = f"{check.metric} = {quantity(check.truth, check.unit)} within {quantity(check.bound, check.unit)}"
        yield f"  {within}" + ("" if check.because == because else f": {check.because}")
        because = check.because
    if len(checks) > MOST_CHECKS:
        yield f"  and {len(checks) - MOST_CHECKS} more: crosscheck describe {shlex.quote(slot.scene)}"
    params = " ".join(f"--param {name}={value!r}" for name, value in slot.params)
    asked = f"{shlex.quote(slot.scene)} {params}".strip()
    cell = f"--dim {slot.dimension} --engine {slot.engine} {shlex.join(profile_words(slot))} --dt {format_dt(slot.dt)}"
    count = f" --iterations {slot.iterations}" if slot.iterations is not None else ""
    yield f"Judged by: crosscheck run {asked} {cell}{count}"
