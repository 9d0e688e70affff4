"""Sequential impulses for rigid bodies in contact, planar and spatial, as a reference to compare engines with.

>>> from reference_solver import Body, Disc, HalfSpace, Model, Settings, Simulation
>>> floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
>>> ball = Body(Disc(0.5), mass=0.5, inertia=0.0625, pose=(0.0, 0.5, 0.0), twist=(0.0, -6.0, 0.0))
>>> model = Model(2, [floor, ball], gravity=(0.0, 0.0), restitution=0.8, friction=0.0)
>>> simulation = Simulation(model, Settings.classical(dt=1 / 240))
>>> simulation.advance(1)
>>> round(float(simulation.twist[1, 1]), 12)
4.8
"""

from reference_solver.model import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Sphere
from reference_solver.records import Contacts, Record
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from reference_solver.step_problem import StepProblem

__all__ = [
    "Body",
    "Box",
    "Capsule",
    "Contacts",
    "Disc",
    "HalfSpace",
    "Model",
    "Polygon",
    "Record",
    "Settings",
    "Simulation",
    "Sphere",
    "StepProblem",
]
