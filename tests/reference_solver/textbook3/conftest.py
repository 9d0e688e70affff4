"""Builders shared by the spatial tests."""

import numpy as np
import pytest

from reference_solver import Body, Box, HalfSpace, Model, Simulation, Sphere

DT = 1.0 / 240.0


class Build:
    """Makes small worlds whose body 0 is a floor at height 0 unless they say otherwise."""

    dt = DT

    @staticmethod
    def floor(**fields):
        pose = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        return Body(HalfSpace((0.0, 0.0, 1.0)), **({"motion": "fixed", "pose": pose} | fields))

    @staticmethod
    def sphere(place, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), radius=0.5, mass=1.0, k=0.4):
        moment = k * mass * radius**2
        return Body(Sphere(radius), mass, (moment,) * 3, (*place, 1.0, 0.0, 0.0, 0.0), (*velocity, *spin))

    @staticmethod
    def box(
        place,
        velocity=(0.0, 0.0, 0.0),
        spin=(0.0, 0.0, 0.0),
        half=(0.5, 0.5, 0.5),
        mass=1.0,
        turn=(1.0, 0.0, 0.0, 0.0),
        **fields,
    ):
        a, b, c = half
        moments = tuple(mass / 3.0 * s for s in (b * b + c * c, a * a + c * c, a * a + b * b))
        turn = tuple(np.asarray(turn) / np.linalg.norm(turn))
        return Body(Box(half), mass, moments, (*place, *turn), (*velocity, *spin), **fields)

    @staticmethod
    def simulation(bodies, settings, gravity=(0.0, 0.0, 0.0), restitution=0.0, friction=0.0, **keywords):
        return Simulation(Model(3, bodies, gravity, restitution, friction), settings, **keywords)

    def column(self, n, settings, friction=0.5, **keywords):
        """n unit boxes, touching, on the floor."""
        boxes = [self.box((0.0, 0.0, 0.5 + i)) for i in range(n)]
        return self.simulation([self.floor(), *boxes], settings, (0.0, 0.0, -9.81), 0.0, friction, **keywords)


def rotation_matrix(q):
    """Rotation matrix of a unit quaternion (w, x, y, z), body to world."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Mechanics:
    """Conserved quantities of a simulation, computed from its public state alone."""

    rotation_matrix = staticmethod(rotation_matrix)

    @staticmethod
    def inertia(body, pose):
        """World inertia tensor of a free body."""
        r = rotation_matrix(pose[3:])
        return r @ np.diag(body.inertia) @ r.T

    def momentum(self, simulation):
        """Momentum of all free bodies."""
        free = [(b, t) for b, t in zip(simulation.model.bodies, simulation.twist, strict=True) if b.motion == "free"]
        return sum(b.mass * t[:3] for b, t in free)

    def angular_momentum(self, simulation):
        """Angular momentum of all free bodies about the origin."""
        total = np.zeros(3)
        for body, pose, twist in zip(simulation.model.bodies, simulation.pose, simulation.twist, strict=True):
            if body.motion == "free":
                total += body.mass * np.cross(pose[:3], twist[:3]) + self.inertia(body, pose) @ twist[3:]
        return total

    def kinetic_energy(self, simulation):
        """Kinetic energy of all free bodies."""
        total = 0.0
        for body, pose, twist in zip(simulation.model.bodies, simulation.pose, simulation.twist, strict=True):
            if body.motion == "free":
                spin = twist[3:]
                total += 0.5 * body.mass * twist[:3] @ twist[:3] + 0.5 * spin @ self.inertia(body, pose) @ spin
        return total


@pytest.fixture
def build():
    return Build()


@pytest.fixture
def mechanics():
    return Mechanics()
