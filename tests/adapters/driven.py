"""Runs of an engine with the settings of a profile, some of them changed."""

from adapters.needs import needs
from adapters.stepping import run
from adapters.trajectory import Sampling
from validation.catalogue import CATALOGUE


def measured_of(engine, name, profile, dimension=2, params=None, dt=1.0 / 240.0, **changes):
    """What a scene of the catalogue reads from a run of it, by metric."""
    scene = CATALOGUE[name].scene(dimension, params or {})
    settings = {s.name: s.value for s in engine.settings(profile, needs(scene), dt)} | changes
    found = run(engine, scene, dt, settings, CATALOGUE[name].sampling(scene))
    return {metric: value for metric, (value, _) in CATALOGUE[name].measure(scene, found).items()}


def driven(engine, usual, dt=1.0 / 240.0):
    """`settings(scene, profile, **changes)` of an engine, and `drive` with the same arguments, which runs the scene."""

    def settings(scene, profile=usual, dt=dt, **changes):
        return {s.name: s.value for s in engine.settings(profile, needs(scene), dt)} | changes

    def drive(scene, profile=usual, dt=dt, **changes):
        return run(engine, scene, dt, settings(scene, profile, dt, **changes), Sampling(1, 0.0))

    return settings, drive
