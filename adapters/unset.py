"""An engine without any settings: documented behaviour, and that measured in small experiments.

An engine's folder states its table in ``unset.py`` as `UNSET` and makes worlds of the bare engine, in which nothing is
set but what an experiment names. The experiments stand here, once for all engines:

    slide     a flat box with a speed along the ground: friction, and how that of two bodies combines
    blow      a ball flies at the ground without gravity: restitution, how it combines, below which speed it is none
    flight    a ball far from everything: dampings, limit of speeds, sleep, gravity as it is
    roll      a ball on the ground: sleep, where only what touches another body may
    rest      a flat box on the ground, a ball in it: the gap at which they come to rest, below 0 an overlap
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

#: Half extents of the box along the ground and upwards, and radius of the ball [m].
HALF_WIDTH, HALF_HEIGHT, RADIUS = 0.5, 0.1, 0.5
#: Gravity where an experiment needs one [m/s^2].
GRAVITY = 9.81
#: Numbers of two bodies whose product, means, larger and smaller one are all different.
FRICTIONS, RESTITUTIONS = (0.2, 0.9), (0.4, 0.9)
#: Speed [m/s] and time [s] of a slide: short, so that what drag takes hardly changes on the way.
SLIDE_SPEED, SLIDE_TIME = 3.0, 0.05
#: Speed [m/s] and time [s] of a blow: faster than any threshold that is known, longer than the softest contact takes.
BLOW_SPEED, BLOW_TIME = 5.0, 0.25
#: Parts of a step after which a ball touches.
PHASES = (1e-3, 0.5)
#: Speed [m/s] and spin [rad/s] that a flight begins with, and its time [s]: too slow for drag to grow with the speed,
#: too short for a body to fall asleep.
FLIGHT_SPEED, FLIGHT_TIME = 1e-3, 0.2
#: Speed of a throw [m/s]: far above every limit that is known, 4000 m/s.
THROWN = 1e5
#: Height of a flight [m], and time after which what still moves does not fall asleep [s].
FAR, LONG = 10.0, 10.0
#: Time in which a body comes to rest [s], and overlap from which it is pushed out [m].
SETTLING, DEEP = 2.0, 0.2
#: Speeds between which a threshold of rebounds is looked for [m/s], and by how many halvings of their ratio, or of a
#: gap: 1e4 in 2^11 parts is 0.45 % each, half a metre 0.24 mm.
SLOWEST, FASTEST, HALVINGS = 1e-3, 10.0, 11


@dataclass(frozen=True)
class Asked:
    """A body above the ground of a bare world; None: as the engine has it when nothing is set.

    Parameters
    ----------
    shape
        ``ball`` of `RADIUS`, or ``box`` of `HALF_WIDTH` and `HALF_HEIGHT`.
    gap
        Between its lowest point and the ground [m].
    along, up, spin
        Velocity along the ground and upwards [m/s], and spin [rad/s].
    gravity
        Downwards [m/s^2].
    friction, restitution
        Numbers of the ground and of the body.
    """

    shape: Literal["ball", "box"] = "ball"
    gap: float = FAR
    along: float = 0.0
    up: float = 0.0
    spin: float = 0.0
    gravity: float | None = 0.0
    friction: tuple[float, float] | None = None
    restitution: tuple[float, float] | None = None

    @property
    def height(self) -> float:
        """Height of the body's centre [m]."""
        return self.gap + (RADIUS if self.shape == "ball" else HALF_HEIGHT)


@dataclass(frozen=True)
class Told:
    """State of the body: gap [m], velocities [m/s], spin [rad/s]."""

    gap: float
    along: float
    up: float
    spin: float


class World(Protocol):
    """A world of the bare engine with one body above the ground."""

    #: Step that it makes [s].
    dt: float

    def advance(self, steps: int) -> None:
        """Make steps."""

    def told(self) -> Told:
        """Tell the body's state."""


#: Makes a world of the bare engine.
Make = Callable[[Asked], World]


@dataclass(frozen=True)
class Unset:
    """One line of the table.

    Parameters
    ----------
    what
        What it is about, with its unit.
    documented
        What the documentation says, in words or a number; ``value`` is that number, for comparison.
    source
        Where it says so.
    measure
        Measures it with the bare engine; None where no experiment does.
    within
        How far the measured number may be off for it to be the documented one.
    """

    what: str
    documented: str
    source: str
    value: float | None = None
    measure: Callable[[], float] | None = None
    within: float = 0.01

    def agrees(self, measured: float) -> bool | None:
        """Whether a measured number is the documented one; None where that is no number."""
        return None if self.value is None else measured == self.value or abs(measured - self.value) <= self.within


def ran(make: Make, asked: Asked, time: float) -> tuple[Told, float]:
    """State of a body after ``time`` [s], to a whole step, and that time."""
    world = make(asked)
    steps = max(1, round(time / world.dt))
    world.advance(steps)
    return world.told(), steps * world.dt


def friction(
    make: Make,
    friction: tuple[float, float] | None = None,
    shape: Literal["ball", "box"] = "box",
    speed: float = SLIDE_SPEED,
    time: float = SLIDE_TIME,
) -> float:
    """Coefficient of friction of a body that slides: momentum that it loses over the impulse of the ground.

    What drag takes in the same time, far from the ground, does not count.
    """
    slid, time = ran(make, Asked(shape, 0.0, along=speed, gravity=GRAVITY, friction=friction), time)
    flown, _ = ran(make, Asked(shape, FAR, along=speed), time)
    return (flown.along - slid.along) / (GRAVITY * time + slid.up)


def restitution(make: Make, restitution: tuple[float, float] | None = None) -> float:
    """Speed of a ball after a blow over that before it, without what drag takes of it; 0 where it does not leave."""
    after = rebound(make, restitution, BLOW_SPEED)
    if after <= FLIGHT_SPEED:
        return 0.0
    flown, _ = ran(make, Asked(gap=FAR, up=after), BLOW_TIME)
    return after**2 / flown.up / BLOW_SPEED


def rebound(make: Make, restitution: tuple[float, float] | None, speed: float, lead: float = 0.0) -> float:
    """Largest speed of a ball after a blow at ``speed`` [m/s], over `PHASES` of a step at which it touches.

    It starts ``lead`` steps of its motion higher. Engines that see contacts ahead take what is left of the way off a
    rebound.
    """
    way = speed * make(Asked()).dt
    blows = [Asked(gap=(lead + phase) * way, up=-speed, restitution=restitution) for phase in PHASES]
    return max(ran(make, blow, BLOW_TIME)[0].up for blow in blows)


def least_rebound(make: Make, lead: float = 0.0) -> float:
    """Speed below which not half of a rebound comes though restitution is 1 [m/s]; 0 if it does at `SLOWEST`."""

    def rebounds(speed: float) -> bool:
        return rebound(make, (1.0, 1.0), speed, lead) > 0.5 * speed

    if rebounds(SLOWEST):
        return 0.0
    low, high = SLOWEST, FASTEST
    for _ in range(HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if rebounds(middle) else (middle, high)
    return high


def damping(make: Make, of: Literal["along", "spin"]) -> float:
    """Rate at which a slow body loses its velocity, or its spin, far from everything [1/s]."""
    begun = Asked(along=FLIGHT_SPEED) if of == "along" else Asked(spin=FLIGHT_SPEED)
    flown, time = ran(make, begun, FLIGHT_TIME)
    return -math.log(getattr(flown, of) / FLIGHT_SPEED) / time + 0.0


def limit(make: Make) -> float:
    """Speed along the ground that is left of `THROWN` after a step, far from everything [m/s]; infinite if all is."""
    after = abs(ran(make, Asked(along=THROWN), 0.0)[0].along)
    return math.inf if after > 0.5 * THROWN else after


def sleep(make: Make, rolls: bool = False) -> float:
    """Time after which a ball at `FLIGHT_SPEED` stands still [s]; infinite if after `LONG` none.

    It is far from everything, or ``rolls`` on the ground: some engines let only what touches another body sleep.
    """
    begun = Asked(gap=0.0, along=FLIGHT_SPEED, gravity=GRAVITY) if rolls else Asked(along=FLIGHT_SPEED)
    world = make(begun)
    for step in range(round(LONG / world.dt)):
        world.advance(1)
        if world.told().along == 0.0:
            return (step + 1) * world.dt
    return math.inf


class Touching(World, Protocol):
    """A world that counts contacts."""

    @property
    def contacts(self) -> int:
        """Contacts of the last step."""


def reach(holds: Callable[[float], bool]) -> float:
    """Largest number below `RADIUS` up to which something holds; 0 where it does for none.

    Parameters
    ----------
    holds
        Whether it holds at a number, such as whether there is a contact at a gap [m].
    """
    low, high = 0.0, RADIUS
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def ahead(make: Callable[[Asked], Touching]) -> float:
    """Largest gap across which there is a contact [m]."""

    def sees(gap: float) -> bool:
        world = make(Asked(gap=gap))
        world.advance(1)
        return world.contacts > 0

    return reach(sees)


def gravity(make: Make) -> float:
    """Acceleration upwards of a ball where no gravity is set [m/s^2]."""
    fallen, time = ran(make, Asked(gravity=None), 0.0)
    return fallen.up / time


def rest(make: Make) -> float:
    """Gap between the ground and a box of the engine's own mass that rests on it [m]; below 0 an overlap."""
    return ran(make, Asked("box", 0.0, gravity=GRAVITY), SETTLING)[0].gap


def left(make: Make) -> float:
    """What is left of an overlap of `DEEP` between a ball and the ground, under gravity [m]."""
    return -ran(make, Asked(gap=-DEEP, gravity=GRAVITY), SETTLING)[0].gap
