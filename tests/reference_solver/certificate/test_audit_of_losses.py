"""Energy that friction takes: no more is lost."""

from reference_solver import Body, Capsule, HalfSpace, Model, Settings, Simulation
from reference_solver.certificate.audit import audit

UP = (1.0, 0.0, 0.0, 0.0)


def test_friction_of_a_rod_that_lies_flush_and_rolls():
    """The record does not tell where it touches at the end of a piece: its slip is taken where it began."""
    radius, dt = 0.094, 1 / 240
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UP), motion="fixed")
    lies, moves = (0.0, 0.0, radius, *UP), (0.93, -0.56, 0.0, 5.7, 0.0, 1.6)
    rod = Body(Capsule(0.24, radius), 0.23, (0.001, 0.009, 0.009), lies, moves, torque=(-0.002, -0.056, 0.048))
    model = Model(3, [floor, rod], (3.6, 1.7, -9.0), 0.0, 0.2)
    record = Simulation(model, Settings.reference(dt)).record(5, pieces=True)
    assert next(finding for finding in audit(model, record, dt) if finding.name == "lost").holds
