"""Tables of scenes: what each cell is made of, its truths, bounds and errors; nothing is run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from telling import Sections, section, word

from adapters.scene import Scene
from validation.canonical import SUITES, CanonicalScene
from validation.catalogue import CATALOGUE

#: Steps at which bounds are told [s]: two, since a bound is made of its powers.
STEPS = {"1/240": 1 / 240, "1/1000": 1 / 1000}
#: Shares of a scene's duration at which the ghost of its replay is told.
INSTANTS = (0.0, 0.3, 0.7, 1.0)

#: What a scene says in a word or a line.
SAID = ("title", "family", "law", "dimensions", "representative", "planted", "size", "smooth")


def cells(canonical: CanonicalScene) -> Iterator[tuple[str, int, dict[str, float]]]:
    """Cells of the standard suite, the one that stands for the scene, and those with planted faults, once each."""
    asked = [(v.params, v.dimensions) for v in canonical.variations("standard")]
    asked += [(params, ()) for params in (canonical.representative, *canonical.planted)]
    met = set()
    for params, dimensions in asked:
        for dimension in dimensions or canonical.dimensions:
            title = " ".join([f"{dimension}-D", *(f"{name}={value:g}" for name, value in sorted(params.items()))])
            if title not in met:
                met.add(title)
                yield title, dimension, dict(params)


def table(name: str) -> Sections:
    """Table of one scene."""
    canonical = CATALOGUE[name]
    return {title: cell(canonical, dimension, params) for title, dimension, params in cells(canonical)} | {
        "beside its cells": timed(canonical) | facts(canonical)
    }


def cell(canonical: CanonicalScene, dimension: int, params: dict[str, float]) -> dict[str, str]:
    """What is built of a cell, and how it is judged."""
    scene = canonical.scene(dimension, params)
    checks = {step: {check.metric: vars(check) for check in canonical.checks(scene, dt)} for step, dt in STEPS.items()}
    said = {metric: [own["unit"], own["because"], own["source"]]
            for metric, own in checks["1/240"].items()}  # fmt: skip
    bounds = {metric: [f"{word(own['truth'])} +- {word(own['bound'])}", word(checks["1/1000"][metric]["bound"])]
              for metric, own in checks["1/240"].items()}  # fmt: skip
    return section(
        scene={field: value for field, value in vars(scene).items() if field != "bodies" and field[0] != "_"},
        bodies={body.name: body for body in scene.bodies},
        sampling=canonical.sampling(scene),
        truth=canonical.exact(scene),
        check=said,
        judged=bounds,
        ghost=ghost(canonical, scene),
    )


def ghost(canonical: CanonicalScene, scene: Scene) -> Any:
    """Exact motion of a body, at some instants."""
    track = canonical.track(scene)
    if track is None:
        return None
    return {track.body: {f"{share:g}": track.position(share * scene.duration) for share in INSTANTS}}


def timed(canonical: CanonicalScene) -> dict[str, str]:
    """Cells of which a bench takes the worst error, and values as people know them."""
    found: dict[str, Any] = {}
    for step, dt in STEPS.items():
        if canonical.primary:
            told = canonical.primary.variations(dt)
            found[step] = {
                "cells": len(told),
                "first": told[0],
                "second": told[min(1, len(told) - 1)],
                "last": told[-1],
            }
    params = canonical.complete(canonical.representative)
    seen = {
        metric: {f"{value:g}": rule(params, value) for value in (0.0, 0.3, 2.0)}
        for metric, rule in canonical.seen_as.items()
    }
    return section(timed=found, seen_as=seen)


def facts(canonical: CanonicalScene) -> dict[str, str]:
    """What a scene says of itself, a line for each parameter and cell: some of it is made by what scenes share."""
    found = {name: str(getattr(canonical, name)) for name in SAID}
    for each in canonical.parameters:
        limits = f"{'(' if each.positive else '['}{each.low:g}, {each.high:g}]{' whole' * each.integer}"
        found[f"parameter {each.name}"] = f"{word(each.default)} {each.unit} in {limits}: {each.because}"
    for suite in SUITES:
        found[f"cells of {suite}"] = "; ".join(
            " ".join([*(f"{name}={value:g}" for name, value in each.params.items()), str(each.iterations),
                      *map(str, each.dimensions)])
            for each in canonical.variations(suite)
        )  # fmt: skip
    steps = canonical.steps
    found["steps"] = "; ".join(f"{[f'{dt:.6g}' for dt in steps.dts(s)]} {steps.counts(s)}" for s in SUITES[::2])
    found["studies"] = ", ".join(study.name for study in canonical.studies)
    told = {"words": canonical.words, "searched": canonical.searched, "restitution": canonical.restitution}
    return found | section(**told, primary=canonical.primary, frontiers=canonical.frontiers)
