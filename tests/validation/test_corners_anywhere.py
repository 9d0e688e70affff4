"""Corners of a scene file may be given anywhere: they are moved to about their centroid, which is said, or refused."""

import numpy as np
import pytest

from adapters.extras import install
from adapters.scene import SceneError
from validation.files.centring import ALIGNED, centre

pytest.importorskip("scipy")

SQUARE = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
BRICK = tuple((x, y, z) for x in (-0.5, 0.5) for y in (-1.0, 1.0) for z in (-0.25, 0.25))


def body(kind, points, **more):
    return {"name": "b", "shape": {"type": kind, "vertices": [list(p) for p in points]}, "inertia": None,
            "motion": "free", **more}  # fmt: skip


def moved(points, by):
    return [tuple(x + y for x, y in zip(p, by, strict=True)) for p in points]


@pytest.mark.parametrize(
    ("kind", "points", "by", "said"),
    [("polygon", SQUARE, (4.0, -2.0), "(4, -2)"), ("hull", BRICK, (0.0, 8.0, 0.125), "(0, 8, 0.125)"),
     ("polygon", SQUARE, (0.0, 1e-6), "(0, 1e-06)")],
)  # fmt: skip
def test_shapes_moved_to_their_centroid_with_a_message(kind, points, by, said):
    given, notes = body(kind, moved(points, by)), ["before"]
    centre(given, notes)
    assert np.array(given["shape"]["vertices"]) == pytest.approx(np.array(points), abs=1e-12)
    assert all(type(x) is float for p in given["shape"]["vertices"] for x in p)
    assert len(notes) == 2 and notes[0] == "before"
    words = notes[1].replace("-0,", "0,")
    assert words.startswith("b.shape.vertices: their centroid (") and words.endswith(") is now the body's centre")
    told = [float(x) for x in notes[1].partition("(")[2].partition(")")[0].split(", ")]
    assert told == pytest.approx([float(x) for x in said[1:-1].split(", ")], abs=1e-9)


@pytest.mark.parametrize(("kind", "points"), [("polygon", SQUARE), ("hull", BRICK)])
def test_centred_shape_unchanged_to_the_bit(kind, points):
    given, notes = body(kind, points), []
    centre(given, notes)
    assert given == body(kind, points) and notes == []
    nearly = moved(points, (1e-16,) * len(points[0]))
    given = body(kind, nearly)
    centre(given, notes)
    assert given == body(kind, nearly) and notes == []


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return [(c * x - s * y, s * x + c * y, z) for x, y, z in BRICK]


def test_moments_of_a_hull_off_its_axes():
    wrong = r"^b\.shape\.vertices: the main axes of inertia are not the body's; turn it, or give inertia$"
    with pytest.raises(SceneError, match=wrong):
        centre(body("hull", turned(0.3)), [])
    with pytest.raises(SceneError, match=wrong):
        centre(body("hull", turned(100.0 * ALIGNED)), [])
    for more in ({"inertia": (1.0, 1.0, 1.0)}, {"motion": "fixed"}, {"motion": "prescribed"}):
        centre(body("hull", turned(0.3), **more), [])
    centre(body("hull", turned(0.1 * ALIGNED)), [])


@pytest.mark.parametrize(
    ("kind", "points", "said"),
    [
        ("polygon", SQUARE[:2], "b.shape.vertices"), ("hull", BRICK[:3], "b.shape.vertices"),
        ("polygon", SQUARE[::-1], "b.shape"), ("polygon", BRICK, "b.shape.vertices"),
        ("hull", SQUARE, "b.shape.vertices"),
        ("polygon", ((0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)), "b.shape"),
    ],
)  # fmt: skip
def test_refusal_of_corners_that_are_no_polygon_or_hull(kind, points, said):
    with pytest.raises(SceneError) as error:
        centre(body(kind, points), [])
    assert str(error.value).startswith(said)


def test_message_without_the_library_of_hulls(monkeypatch):
    def missing(points):
        raise ModuleNotFoundError("scipy")

    monkeypatch.setattr("validation.files.centring.hull_properties", missing)
    with pytest.raises(SceneError) as error:
        centre(body("hull", BRICK), [])
    assert str(error.value) == f"b.shape.vertices: a hull needs scipy: {install('shapes')}"
    centre(body("polygon", SQUARE), [])  # needs none
