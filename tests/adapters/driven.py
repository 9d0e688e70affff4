"""Runs of an engine with the settings of a profile, some of them changed; a box at rest, and a ball that strikes."""

from dataclasses import replace

from adapters.needs import needs
from adapters.scene import Body, Box, HalfSpace, Pair, Scene, Sphere
from adapters.stepping import run
from adapters.trajectory import Sampling
from validation.catalogue import CATALOGUE

FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")


def resting(mu=0.5, duration=0.5, **changes):
    """A box on the ground, with other properties where ``changes`` give them."""
    box = Body("box", Box((0.5, 0.4, 0.25)), 3.0, (0.2, 0.3, 0.4), (0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0))
    return Scene("rest", 1, 3, (FLOOR, replace(box, **changes)), (Pair(friction=mu),), (0.0, 0.0, -9.81), duration)


def struck(e, speed, gap, mu=0.0, slip=0.0, steps=12, dt=1.0 / 240.0):
    """A ball that approaches the ground from ``gap`` [m] above it, without gravity, with a ``slip`` along it [m/s]."""
    place, twist = (0.0, 0.0, 0.5 + gap, 1.0, 0.0, 0.0, 0.0), (slip, 0.0, -speed, 0.0, 0.0, 0.0)
    ball = Body("ball", Sphere(0.5), 1.0, (0.1, 0.1, 0.1), place, twist)
    return Scene("blow", 1, 3, (FLOOR, ball), (Pair(restitution=e, friction=mu),), (0.0, 0.0, 0.0), steps * dt)


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
