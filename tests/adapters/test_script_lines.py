"""Lines that scripts of all engines have in common: read back by Python they are what the adapters compute."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from adapters import script
from adapters.scene import Body, Box, Disc, Harmonic, Pair, Scene
from adapters.scene.drives import place_after, velocity_over

DT = 1 / 240
COURSES = [None, Harmonic((0.25, -0.5), 2.0, 0.75), Harmonic((0.0, 0.1), 0.3, 0.0)]
PLATE = Body("plate", Box((1.0, 0.5)), pose=(0.5, -2.0, 0.1), twist=(0.25, -1.5, 0.5), motion="prescribed")
SCENE = Scene("plates", 1, 2, (PLATE, Body("ball", Disc(0.5), 2.0, 0.25)), (Pair(),), (0.0, -9.81), 1.0)


@pytest.mark.parametrize("course", COURSES)
def test_place_and_speed_of_a_prescribed_body(course):
    """To the last bit: the same operations in the same order."""
    body = replace(SCENE, bodies=(replace(PLATE, course=course), SCENE.bodies[1])).bodies[0]
    for done in (1, 2, 77):
        told = eval(script.place(body), {"math": math, "time": done * DT})
        assert told == tuple(place_after(body, done * DT))
        fast = eval(script.velocity(body), {"math": math, "DT": DT, "done": done})
        assert fast == tuple(velocity_over(body, DT, done - 1))
    needed = "import math" in script.imports(replace(SCENE, bodies=(body,)), "import engine")
    assert needed is (course is not None) and "import math" in script.imports(SCENE, angles=True)


def test_materials_pair_by_pair_with_the_commonest_once():
    balls = tuple(Body(name, Disc(0.5), 1.0, 0.1, (2.0 * k, 0.0, 0.0)) for k, name in enumerate("abcd"))
    pairs = (Pair("*", "*", 0.5, 0.25), Pair("a", "b", 0.75, 0.0), Pair("c", "d", 0.125, 1.0))
    scene = Scene("four", 1, 2, balls, pairs, (0.0, 0.0), 1.0)
    lines, found = script.materials(scene), {}
    exec("\n".join(lines), found)
    for i, a in enumerate("abcd"):
        for j, b in enumerate("abcd"):
            if i != j:
                pair = scene.material(a, b)
                assert found["material"](i, j) == (pair.restitution, pair.friction)
    assert found["COMMON"] == (0.5, 0.25) and len(found["MATERIALS"]) == 2
    assert lines[0] == "# Restitution and friction of pairs of bodies, by their numbers, and of all others."
    assert script.materials(replace(scene, bodies=balls[:1], pairs=())) == []


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.float64(0.1), "0.1"), (np.array([1.5, 2.0]), "(1.5, 2.0)"), ([1], "(1,)"), ((), "()"), ("a'b", '"a\'b"'),
        (np.array([[1, 2], [3, 4]]), "((1, 2), (3, 4))"), (None, "None"), (True, "True"),
    ],
)  # fmt: skip
def test_numbers_are_written_as_python_reads_them_back(value, said):
    assert script.literal(value) == said
    assert script.keywords({"a": value, "b": 2}) == f"a={said}, b=2"


def test_states_of_a_script_at_start_tenths_and_end(capsys):
    lines = ["import json", *script.constants(0.25, 25), "x = [0.0]", "def state():", "    return {'b': (x, [1.0])}"]
    exec(script.text([*lines, *script.stepped(["x[0] += DT"])]), {})
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    steps = [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 25]
    assert told == [{"t": 0.25 * n, "bodies": {"b": {"pose": [0.25 * n], "twist": [1.0]}}} for n in steps]
    assert script.text(["a", "b"]) == "a\nb\n"
