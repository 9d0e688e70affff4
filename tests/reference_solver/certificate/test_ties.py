"""Where many directions part two boxes equally far, the audit takes those of the law and no other."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from reference_solver import Body, Box, Model, Settings, Simulation
from reference_solver.certificate.audit import audit
from reference_solver.geometry import partings, rotation
from reference_solver.pieces import IMPACT

DT = 1.0 / 240.0
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def landed():
    """The lowest corner of a box comes down on the edge of another."""
    table = Body(Box((0.5, 0.5, 0.5)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    half, q = np.array([0.2, 0.25, 0.15]), np.array([0.85, 0.35, 0.3, 0.1])
    q /= np.linalg.norm(q)
    turn = rotation(np.array([0.0, 0.0, 0.0, *q]))
    corners = (np.array(list(product((-1.0, 1.0), repeat=3))) * half) @ turn.T
    place = np.array([0.5, 0.1, 0.51]) - corners[corners[:, 2].argmin()]
    box = Body(Box(tuple(half)), 1.0, (0.03, 0.02, 0.03), (*place, *q), (0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    return recorded(table, box)


def met():
    """Two upright boxes meet edge on edge: the one comes in sideways at .3 m/s, and down at 1 m/s."""
    table = Body(Box((0.5, 0.5, 0.5)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    box = Body(Box((0.2,) * 3), 1.0, (0.03,) * 3, (0.703, 0.1, 0.71, *UPRIGHT), (-0.3, 0.0, -1.0, 0.0, 0.0, 0.0))
    return recorded(table, box)


def recorded(*bodies):
    model = Model(3, bodies, (0.0, 0.0, 0.0), 0.0, 0.0)
    record = Simulation(model, Settings.reference(DT)).record(4, pieces=True)
    assert (record.pieces.kind == IMPACT).any()
    return model, record


def failed(model, record, normal=None):
    if normal is not None:
        many = np.tile(normal, (len(record.pieces.normal), 1))
        record = replace(record, pieces=replace(record.pieces, normal=many))
    return {f.name for f in audit(model, record, DT) if not f.holds}


@pytest.mark.parametrize("scene", [landed, met])
def test_the_law_s_own_normal_passes(scene):
    assert failed(*scene()) == set()


def test_normal_between_those_of_two_faces():
    """It parts both bodies as far as they are apart, and is neither a face's nor square to an edge of each."""
    model, record = landed()
    normal = np.array([0.1, 0.0, 1.0]) / math.sqrt(1.01)
    pieces = record.pieces
    first = pieces.first_body[int(np.flatnonzero(pieces.kind == IMPACT)[0])]
    row = first + int(np.flatnonzero(pieces.body[first : first + 2] == 1)[0])
    table, box = model.bodies
    known = partings(table.shape, np.array([table.pose]), box.shape, pieces.pose_before[row][None])
    low = np.sort(np.linalg.norm(known.axes - normal, axis=2))[0, 0]
    assert low > 1e-3 and known.apart.max() == pytest.approx(0.0, abs=1e-9)
    assert "direction" in failed(model, record, normal)


def test_choice_between_faces_that_tie():
    """Along the side they close at .3 m/s, along the top at 1: the top may not be taken."""
    model, record = met()
    assert "choice" in failed(model, record, (0.0, 0.0, 1.0))
    assert "choice" not in failed(model, record, (1.0, 0.0, 0.0))


def test_partings_of_boxes():
    model, _ = landed()
    table, box = model.bodies
    known = partings(table.shape, np.array([table.pose]), box.shape, np.array([box.pose]))
    assert known.axes.shape == (1, 30, 3) and known.faces.sum() == 12
    assert np.allclose(np.linalg.norm(known.axes, axis=2), 1.0)
