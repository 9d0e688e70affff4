"""Impacts that do not rebound, and what is pressed in phases (E82)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Box, Model, Settings, Simulation
from reference_solver.certificate.audit import audit
from reference_solver.pieces import TURNING
from tests.verification import self_test
from tests.verification.known import gates


def refused(model, record, dt):
    return {finding.name for finding in audit(model, record, dt) if not finding.holds}


@pytest.mark.parametrize("scene", ["disc that bounces", "sphere that bounces"])
def test_blow_without_any_rebound(scene):
    """It comes down far faster than what loads do in two steps: only slower ones may be held."""
    dead = self_test.given(lambda model, _: replace(model, restitution=0.0 * model.restitution))
    assert "normal" in self_test.seen_by(*dead(self_test.SCENES[scene], 0.0))


def test_parting_at_the_begin_of_a_pressed_phase():
    """By a millionth of a metre a second."""
    motion = gates.MOTIONS["ball slipping along a groove"](np.random.default_rng(0))
    dt = motion.time / 40
    record = Simulation(motion.model, Settings.reference(dt)).record(40, pieces=True)
    pieces, before = record.pieces, record.pieces.twist_before.copy()
    contact = len(pieces.body_a) // 2
    piece = int(np.searchsorted(pieces.first_contact, contact, "right")) - 1
    assert pieces.scheme[piece] == TURNING
    assert "normal" not in refused(motion.model, record, dt)
    before[pieces.first_body[piece + 1] - 1, :3] += 1e-6 * pieces.normal[contact]
    assert "normal" in refused(motion.model, replace(record, pieces=replace(pieces, twist_before=before)), dt)


@pytest.mark.parametrize("angle", [0.0, 0.3, -0.6])
def test_normals_of_corners_that_meet(angle):
    """Along many directions corners that touch are as far apart; the law knows those of edges, at 45 degrees."""
    turn = 0.25 * math.pi
    bodies = [
        Body(Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.0, turn), (1.0, -0.4, 0.0)),
        Body(Box((0.5, 0.5)), 1.0, 1 / 6, (math.sqrt(2.0) + 0.1, -0.04, turn)),
    ]
    model, dt = Model(2, bodies, (0.0, 0.0), 0.0, 0.0), 1.0 / 240.0
    record = Simulation(model, Settings.reference(dt)).record(30, pieces=True)
    assert len(record.pieces.normal) and "direction" not in refused(model, record, dt)
    normal = np.zeros_like(record.pieces.normal) + [math.cos(angle), math.sin(angle)]
    other = replace(record, pieces=replace(record.pieces, normal=normal))
    assert "direction" in refused(model, other, dt)
