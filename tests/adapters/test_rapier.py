"""The Rapier adapter, on small scenes with known answers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from driven import FLOOR, driven, resting

from adapters.conformance import items
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.rapier import RapierEngine
from adapters.receipts import receipts
from adapters.scene import Body, Pair, Scene, Sphere

pytestmark = pytest.mark.optional("rapier")
ENGINE = RapierEngine()
DT = 1.0 / 240.0
settings, drive = driven(ENGINE, "default")


@pytest.mark.parametrize("item", items(ENGINE), ids=str)
def test_conformance(item):
    item.hold()


def test_default_is_what_fresh_parameters_hold():
    import rapier3d

    held, chosen = rapier3d.IntegrationParameters(), settings(resting())
    assert chosen["iterations"] == held.num_internal_pgs_iterations and chosen["substeps"] == held.num_solver_iterations
    assert chosen["frequency"] == held.contact_softness.natural_frequency
    assert chosen["static_frequency"] == held.static_contact_softness.natural_frequency
    assert chosen["damping_ratio"] == held.contact_softness.damping_ratio == held.static_contact_softness.damping_ratio
    assert chosen["allowed_error"] == pytest.approx(held.normalized_allowed_linear_error)
    assert chosen["prediction"] == pytest.approx(held.normalized_prediction_distance)
    assert chosen["recycling"] == held.contact_recycling and chosen["clustering"] == held.contact_clustering
    assert chosen["relaxations"] == held.num_internal_stabilization_iterations
    assert chosen["fastest"] == held.normalized_max_linear_velocity
    assert chosen["push_out"] == held.normalized_max_corrective_velocity
    assert held.friction_model == rapier3d.FrictionModel.SIMPLIFIED


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"iterations": 0}, "iterations"), ({"substeps": True}, "substeps"), ({"frequency": -1.0}, "frequency"),
     ({"damping_ratio": math.inf}, "damping_ratio"), ({"recycling": 1}, "recycling"),
     ({"friction_model": "dry"}, "friction_model"), ({"slop": 0.1}, "slop"),
     ({"relaxations": -1}, "relaxations"), ({"fastest": math.nan}, "fastest"), ({"push_out": "3"}, "push_out"),
     ({"clustering": 0}, "clustering")],
)  # fmt: skip
def test_refusal_of_a_bad_setting_by_name(changes, field):
    with pytest.raises(EngineError, match=rf"^{field}[^\n]*\Z"):
        ENGINE.build(resting(), DT, settings(resting(), **changes))


def test_impulses_of_smooth_and_rough_contacts():
    smooth, rough = (drive(resting(mu)).contacts.impulse_between(0, 1)[-60:] / DT for mu in (0.0, 0.5))
    assert np.isfinite(smooth).all() and smooth[:, 2].mean() == pytest.approx(3.0 * 9.81, rel=1e-3)
    assert rough[:, 2].mean() == pytest.approx(3.0 * 9.81, rel=1e-3) and np.isnan(rough[:, :2]).all()


@pytest.mark.parametrize("changes", [{"relaxations": 7}, {"fastest": 5.0}, {"push_out": 0.25}, {"clustering": False}])
def test_settings_in_the_world(changes):
    held = drive(replace(resting(), duration=DT), **changes).readback
    assert {name: held[name] for name in changes} == changes


def test_limit_of_speed_by_profile():
    box = replace(resting().bodies[1], twist=(500.0, 0.0, 0.0, 0.0, 0.0, 0.0), pose=(0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0))
    fast = replace(resting(), bodies=(FLOOR, box), gravity=(0.0, 0.0, 0.0), duration=5 * DT)
    assert drive(fast).twist[-1, 1, 0] == pytest.approx(400.0, rel=1e-6)
    assert drive(fast, "tuned").twist[-1, 1, 0] == pytest.approx(500.0, rel=1e-6)


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 1000, 1 / 2000])
def test_spin_round_off_in_small_steps(profile, dt):
    slips = receipts(ENGINE, profile, needs(resting()), dt)
    assert [slip.quantity for slip in slips if not slip.holds] == []
    (spin,) = (slip for slip in slips if slip.quantity == "angular_damping")
    assert spin.band < 0.01  # drag of 1 % a second would be seen


def test_loads_act_in_every_step():
    found = drive(resting(0.0, force=(3.0, 0.0, 0.0)))
    assert found.twist[-1, 1, 0] == pytest.approx(0.5, rel=1e-4)


def test_each_pair_has_its_own_material():
    balls = tuple(
        Body(
            name, Sphere(0.5), 1.0, (0.1, 0.1, 0.1), (3.0 * k, 0.0, 0.52, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -2.0, 0, 0, 0)
        )
        for k, name in enumerate("abc")
    )
    pairs = tuple(Pair("floor", name, e) for name, e in (("a", 0.9), ("b", 0.4), ("c", 0.0)))
    found = drive(Scene("pairs", 1, 3, (FLOOR, *balls), pairs, (0.0, 0.0, 0.0), 0.2))
    assert found.twist[-1, 1:, 2] == pytest.approx([1.8, 0.8, 0.0], abs=1e-4)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_blow_friction_by_the_compression_impulse_only(e):
    """A quirk that is stated: mu / (1 + e) of the whole blow."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.52, 1, 0, 0, 0), (6.0, 0.0, -2.0, 0, 0, 0))
    found = drive(Scene("blow", 1, 3, (FLOOR, ball), (Pair(restitution=e, friction=0.2),), (0.0, 0.0, 0.0), 0.2))
    assert found.twist[-1, 1, 2] == pytest.approx(2.0 * e, abs=2e-3)
    assert 6.0 - found.twist[-1, 1, 0] == pytest.approx(0.2 * 2.0, rel=2e-3)
