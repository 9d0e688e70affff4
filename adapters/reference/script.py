"""A run on our solver as a stand-alone script: only `reference_solver`, without the rest of the project."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.reference.simulation import solver_model
from adapters.scene import Scene
from adapters.script import constants, keywords, stepped, text


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with `reference_solver`; see `adapters.engine.Writer`."""
    model = solver_model(scene)
    lines = ["import json", "", "from numpy import zeros", ""]
    kinds = sorted({type(body.shape).__name__ for body in model.bodies})
    lines.append(f"from reference_solver import Body, {', '.join(kinds)}, Model, Settings, Simulation")
    lines += ["", *constants(dt, steps), "", "bodies = {"]
    lines += [f"    {asked.name!r}: {body!r}," for asked, body in zip(scene.bodies, model.bodies, strict=True)]
    lines += ["}", "n = len(bodies)", "restitution, friction = zeros((n, n)), zeros((n, n))"]
    for i, j, material in scene.contact_pairs():
        if material.restitution:
            lines.append(f"restitution[{i}, {j}] = restitution[{j}, {i}] = {material.restitution!r}")
        if material.friction:
            lines.append(f"friction[{i}, {j}] = friction[{j}, {i}] = {material.friction!r}")
    lines.append(f"model = Model({scene.dimension}, list(bodies.values()), {scene.gravity!r}, restitution, friction)")
    lines.append(f"simulation = Simulation(model, Settings(dt=DT, {keywords(settings)}))")
    lines += ["", "", "def state():", "    pose, twist = simulation.pose.tolist(), simulation.twist.tolist()"]
    lines.append("    return dict(zip(bodies, zip(pose, twist)))")
    return text(lines + stepped(["simulation.advance(1)"]))
