"""Builders shared by the planar tests."""

import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Simulation

DT = 1.0 / 240.0


class Build:
    """Makes small worlds whose body 0 is a floor at height 0 unless they say otherwise."""

    dt = DT

    @staticmethod
    def floor(**fields):
        return Body(HalfSpace((0.0, 1.0)), **({"motion": "fixed"} | fields))

    @staticmethod
    def disc(x, y, twist=(0.0, 0.0, 0.0), radius=0.5, mass=1.0, **fields):
        return Body(Disc(radius), mass, 0.5 * mass * radius**2, (x, y, 0.0), twist, **fields)

    @staticmethod
    def box(x, y, twist=(0.0, 0.0, 0.0), half=(0.5, 0.5), mass=1.0, angle=0.0, **fields):
        inertia = mass * (half[0] ** 2 + half[1] ** 2) / 3.0
        return Body(Box(half), mass, inertia, (x, y, angle), twist, **fields)

    @staticmethod
    def simulation(bodies, settings, gravity=(0.0, 0.0), restitution=0.0, friction=0.0, **keywords):
        return Simulation(Model(2, bodies, gravity, restitution, friction), settings, **keywords)

    def column(self, n, settings, friction=0.5, **keywords):
        """n unit boxes, touching, on the floor."""
        boxes = [self.box(0.0, 0.5 + i) for i in range(n)]
        return self.simulation([self.floor(), *boxes], settings, (0.0, -9.81), 0.0, friction, **keywords)


@pytest.fixture
def build():
    return Build()
