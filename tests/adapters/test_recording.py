"""What an adapter calls is written as lines that make the same world."""

from types import SimpleNamespace

import numpy as np
import pytest

from adapters.recording import LONG, written
from adapters.scene import Body, Disc, Scene

DT = 0.25
BALLS = tuple(Body(name, Disc(0.5), 2.0, 0.25, (2.0 * k, 0.5, 0.0)) for k, name in enumerate(["a", "'b'"]))
SCENE = Scene("balls", 1, 2, BALLS, (), (0.0, -9.81), 1.0)
NAMES = {"world": "World", "part, joint": "make", "held": "settings", "": "add"}


class Engine:
    """A toy module: it keeps what is done to it."""

    RED = object()

    def __init__(self):
        self.done = []

    def __getattr__(self, name):  # World, Shape
        def made(*given, **named):
            self.done.append((name, given, named))
            return Thing(self, name)

        return made


class Thing:
    def __init__(self, engine, kind):
        object.__setattr__(self, "engine", engine)
        object.__setattr__(self, "kind", kind)

    def __setattr__(self, name, value):
        self.engine.done.append((self.kind, name, value))

    def __getitem__(self, key):
        return (1.5, 2.5)[key]

    @property
    def settings(self):
        return Thing(self.engine, "settings")

    def make(self, *given):
        self.engine.done.append((self.kind, "make", given))
        return Thing(self.engine, "part"), Thing(self.engine, "joint")

    def add(self, *given, **named):
        self.engine.done.append((self.kind, "add", given, named))
        return self

    def step(self, dt):
        self.engine.done.append((self.kind, "step", dt))


def shown(value):
    """Calls with their arguments: an object of the toy by its kind, a number of numpy by its value."""
    if isinstance(value, list | tuple):
        return [shown(each) for each in value]
    value = value.tolist() if isinstance(value, np.generic) else value
    return value.kind if isinstance(value, Thing) else repr(value).partition(" at ")[0]


class Tag:
    """An object of an adapter's own."""


class World:
    def __init__(self, scene, dt, settings, module):
        self.dt = dt
        self.world = module.World(dt, gravity=scene.gravity)
        self.world.settings.sweeps = settings["sweeps"]
        self.world.tag = Tag()
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        self.second = module.World([np.float64(0.5)], colour=module.RED)
        pair = self.world.make(), self.world.make()
        pair[1][1].colour = 2
        self.second.add(self.bodies[0], np.array([0.5]), np.array([0.1], np.float32))

    def _made(self, index, asked):
        part, joint = self.world.make(index)
        x, y = joint
        assert (x, y) == (1.5, 2.5)
        part.shape = self.module_shape(part)
        return part

    def module_shape(self, part):
        return part.engine.Shape((part,), "of")

    def advance(self, steps):
        for _ in range(steps):
            self.bodies[1].add(0.5)
            self.world.step(self.dt)

    def close(self):
        self.world.add("closed")


def test_script_lines_build_the_adapter_s_world():
    engine = Engine()
    lines, step = written(World, engine, "engine", NAMES, (SCENE, DT, {"sweeps": 3}), {Tag: "tag"})
    assert lines == [
        "world = engine.World(DT, gravity=(0.0, -9.81))",
        "held = world.settings",
        "held.sweeps = 3",
        "world.tag = tag",
        "",
        "part, joint = world.make(0)",
        "part.shape = part.engine.Shape((part,), 'of')",
        "bodies['a'] = part",
        "",
        "part, joint = world.make(1)",
        "part.shape = part.engine.Shape((part,), 'of')",
        "bodies[\"'b'\"] = part",
        "",
        "world2 = engine.World([0.5], colour=engine.RED)",
        "part, joint = world.make()",
        "part2, joint2 = world.make()",
        "joint2.colour = 2",
        "world2.add(bodies['a'], np.array((0.5,)), np.array((0.1,), np.float32))",
    ]
    assert step == ["bodies[\"'b'\"].add(0.5)", "world.step(DT)"]
    again = Engine()
    again.RED = Engine.RED
    exec("\n".join(lines), {"engine": again, "DT": DT, "bodies": {}, "np": np, "tag": Tag()})
    assert shown(again.done) == shown(engine.done)[:-1]
    assert engine.done[-1] == ("World", "add", ("closed",), {})  # and no step: it is written and not made


@pytest.mark.parametrize(("names", "said"), [
    ({**NAMES, "world": ""}, "World(DT, gravity=(0.0, -9.81)) is used twice and needs a name"),
    ({**NAMES, "": ""}, "are not used, and each needs a name"),
])  # fmt: skip
def test_call_repeated_or_never_made_needs_a_name(names, said):
    del names[""]
    names = {name: words for name, words in names.items() if words}
    with pytest.raises(AssertionError) as refused:
        written(World, Engine(), "engine", names, (SCENE, DT, {"sweeps": 3}), {Tag: "tag"})
    assert said in str(refused.value)


def test_long_call_written_argument_by_argument():
    class Long(World):
        def __init__(self, scene, dt, settings, module):
            self.dt, self.bodies = dt, [None, SimpleNamespace(add=lambda force: None)]
            self.world = module.World("x" * LONG, dt=dt)

    lines, _ = written(Long, Engine(), "engine", NAMES, (SCENE, DT, {}))
    assert lines == [f"world = engine.World(\n    '{'x' * LONG}',\n    dt=DT,\n)"]
