"""Experiments on MuJoCo."""

from __future__ import annotations

from typing import Any

from validation.experiments import Cured, Experiment

#: Iterations are left alone: Newton's count is a limit that is not reached.
CANDIDATES: dict[str, tuple[Any, ...]] = {
    "impratio": (1.0, 10.0, 100.0, 1000.0),
    "solreffriction": (None, (0.01, 1.0), (0.02, 1.0), (0.05, 1.0), (0.1, 1.0), (0.2, 1.0)),
    "noslip_iterations": (0, 10),
    "kappa_plastic": (0.01, 0.1, 0.5),
    "cone": ("elliptic", "pyramidal"),
    "integrator": ("Euler", "implicitfast"),
}

#: The stiffness that "reflect" makes solref from: neither of the two means anything without the other.
BELONGS: dict[str, str] = {"kappa_elastic": "solref", "kappa_plastic": "solref"}
#: Its tuned profile sticks where it should, and slides too slowly.
CURED: tuple[Cured, ...] = (
    Cured("impact", ({}, {"e": 0.0, "v": 1.0}, {"e": 1.0, "v": 50.0})),
    Cured("bounce", ({}, {"e": 0.5}, {"e": 1.0})),
    Cured("stack", ({}, {"n": 2.0}, {"n": 20.0})),
    Cured("incline", ({}, {"ratio": 0.999}), ("creep",)),
)

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        "stack-touching-start",
        "with a margin of 1 mm touching faces are in contact from the start, and nothing falls; stiffer contacts from "
        "a touching start fall all the same",
        "default",
        "stack",
        "penetration",
        {"margin": 1e-3},
        {"n": n},
        dimension=dimension,
        idle=({"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)},),
    )
    for n in (2.0, 10.0)
    for dimension in (2, 3)
) + tuple(
    Experiment(
        "incline-pyramid-threshold",
        "with an elliptic cone the box slides as soon as it should; solving further or a noslip pass changes nothing: "
        "it is the pyramid, whose edges share their softness between friction and the normal",
        "default",
        "incline",
        "threshold",
        {"cone": "elliptic"},
        dimension=dimension,
        idle=({"tolerance": 0.0}, {"noslip_iterations": 10}),
    )
    for dimension in (2, 3)
)
