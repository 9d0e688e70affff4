"""Tables of scenes: what each cell is made of, its truths, bounds and errors; nothing is run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from telling import Sections, section, word

from adapters.scene import Body, Scene
from validation.canonical import SUITES, CanonicalScene, Suite, Variation
from validation.catalogue import CATALOGUE

#: Steps at which bounds are told [s]: the second for the first cell alone, since a bound is made of powers of the step.
DT, FINER = 1 / 240, 1 / 1000
#: Shares of a scene's duration at which the ghost of its replay is told.
INSTANTS = (0.0, 0.3, 0.7, 1.0)

#: What a scene says in a word or a line.
SAID = ("title", "family", "law", "dimensions", "representative", "planted", "size", "smooth")


def cells(canonical: CanonicalScene, suite: Suite = "quick") -> Iterator[tuple[str, int, dict[str, float]]]:
    """Cells of a suite, the one that stands for the scene, and those with planted faults, once each."""
    asked = [(v.params, v.dimensions) for v in canonical.variations(suite)]
    asked += [(params, ()) for params in (canonical.representative, *canonical.planted)]
    met = set()
    for params, dimensions in asked:
        for dimension in dimensions or canonical.dimensions:
            key = dimension, *sorted(canonical.complete(params).items())
            if key not in met:
                met.add(key)
                title = " ".join([f"{dimension}-D", *(f"{name}={value:g}" for name, value in sorted(params.items()))])
                yield title, dimension, dict(params)


def table(name: str) -> Sections:
    """Table of one scene."""
    canonical = CATALOGUE[name]
    return {title: cell(canonical, dimension, params) for title, dimension, params in cells(canonical)} | {
        "beside its cells": timed(canonical) | facts(canonical)
    }


def cell(canonical: CanonicalScene, dimension: int, params: dict[str, float]) -> dict[str, str]:
    """What is built of a cell, and how it is judged; what is nothing (no load, rest) is left out."""
    scene = canonical.scene(dimension, params)
    checks = canonical.checks(scene, DT)
    judged = {check.metric: f"{word(check.truth)} +- {word(check.bound)}" for check in checks}
    told = {check.metric: check.truth for check in checks}
    more = {name: value for name, value in canonical.exact(scene).items() if told.get(name) != value}
    whole = {field: value for field, value in vars(scene).items() if field not in ("bodies", "pairs", "name", "params")}
    return section(
        scene={field: value for field, value in whole.items() if field[0] != "_"},
        pairs=[{field: value for field, value in vars(pair).items() if value != "*"} for pair in scene.pairs],
        params=canonical.complete(params),
        bodies={body.name: something(body) for body in scene.bodies},
        sampling=canonical.sampling(scene),
        **({"truth": more} if more else {}),
        check=once({check.metric: f"{check.unit}: {check.because} ({check.source})" for check in checks}),
        judged=judged,
        ghost=ghost(canonical, scene),
    )


def something(body: Body) -> dict[str, Any]:
    """Fields of a body that say something."""
    nothing = ("force", "torque", "surface_velocity", "course", "twist")
    return {field: value for field, value in vars(body).items()
            if field != "name" and not (field in nothing and (value is None or not np.any(value)))}  # fmt: skip


def once(said: dict[str, str]) -> dict[str, str]:
    """What is said of ``apex[1]`` to ``apex[5]`` once, as of ``apex[*]``, where it is the same."""
    groups = dict[str, list[str]]()
    for metric in said:
        groups.setdefault(metric.partition("[")[0], []).append(metric)
    same = {f"{stem}[*]": said[own[0]] for stem, own in groups.items()
            if len(own) > 1 and len({said[name] for name in own}) == 1}  # fmt: skip
    return {metric: text for metric, text in said.items() if f"{metric.partition('[')[0]}[*]" not in same} | same


def ghost(canonical: CanonicalScene, scene: Scene) -> Any:
    """Exact motion of a body, at some instants."""
    track = canonical.track(scene)
    if track is None:
        return None
    return {track.body: {f"{share:g}": track.position(share * scene.duration) for share in INSTANTS}}


def timed(canonical: CanonicalScene) -> dict[str, str]:
    """Cells of which a bench takes the worst error, bounds at a finer step, and values as people know them."""
    primary = canonical.primary
    asked = primary.variations(DT) if primary else []
    found = {"cells": len(asked), "first": asked[0], "second": asked[min(1, len(asked) - 1)], "last": asked[-1]}
    params = canonical.complete(canonical.representative)
    scene = canonical.scene(canonical.dimensions[0], params)
    seen = {
        metric: {f"{value:g}": rule(params, value) for value in (0.0, 0.3, 2.0)}
        for metric, rule in canonical.seen_as.items()
    }
    finer = {check.metric: check.bound for check in canonical.checks(scene, FINER)}
    return section(timed=found if asked else {}, seen_as=seen, at_1_1000=finer)


def facts(canonical: CanonicalScene) -> dict[str, str]:
    """What a scene says of itself, a line for each parameter and cell: some of it is made by what scenes share."""
    found = {name: str(getattr(canonical, name)) for name in SAID}
    for each in canonical.parameters:
        limits = f"{'(' if each.positive else '['}{each.low:g}, {each.high:g}]{' whole' * each.integer}"
        found[f"parameter {each.name}"] = f"{word(each.default)} {each.unit} in {limits}: {each.because}"
    for suite in SUITES:
        found[f"cells of {suite}"] = told_cells(canonical.variations(suite))
    steps = canonical.steps
    found["steps"] = "; ".join(f"{[f'{dt:.6g}' for dt in steps.dts(s)]} {steps.counts(s)}" for s in SUITES[::2])
    found["studies"] = ", ".join(study.name for study in canonical.studies)
    told = {"words": canonical.words, "searched": canonical.searched, "restitution": canonical.restitution}
    return found | section(**told, primary=canonical.primary, frontiers=canonical.frontiers)


def told_cells(variations: Sequence[Variation]) -> str:
    """Cells in one line; of more than eight their number and the values of each parameter."""
    if len(variations) > 8:
        values = dict[str, dict[str, None]]()
        for each in variations:
            for name, value in each.params.items():
                values.setdefault(name, {})[f"{value:g}"] = None
        return "; ".join([f"{len(variations)}", *(f"{name} in {' '.join(own)}" for name, own in values.items())])
    return "; ".join(
        " ".join([*(f"{name}={value:g}" for name, value in each.params.items()), str(each.iterations),
                  *map(str, each.dimensions)])
        for each in variations
    )  # fmt: skip
