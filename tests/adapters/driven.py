"""Runs of an engine with the settings of a profile, some of them changed."""

from adapters.needs import needs
from adapters.stepping import run
from adapters.trajectory import Sampling


def driven(engine, usual, dt=1.0 / 240.0):
    """`settings(scene, profile, **changes)` of an engine, and `drive` with the same arguments, which runs the scene."""

    def settings(scene, profile=usual, dt=dt, **changes):
        return {s.name: s.value for s in engine.settings(profile, needs(scene), dt)} | changes

    def drive(scene, profile=usual, dt=dt, **changes):
        return run(engine, scene, dt, settings(scene, profile, dt, **changes), Sampling(1, 0.0))

    return settings, drive
