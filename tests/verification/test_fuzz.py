"""Random scenes are sound worlds, what is certified among them agrees with its variants, and what would not is seen."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver.certificate.truth import certify, distance
from reference_solver.geometry import gap
from reference_solver.settings import Settings
from reference_solver.shapes import Polygon
from reference_solver.simulation import Simulation
from tests.verification.fuzz import trial
from tests.verification.fuzz.scenes import STRIDE, chain, scene
from tests.verification.fuzz.trial import attack, conditions
from tests.verification.fuzz.variants import OFTENER, TOLERANCES, Variant, variants

#: Scenes that were refused, right as they were: hops by noise and ends of series (planar), slips that turn (in space).
ONCE_REFUSED = [
    *((2, seed) for seed in (0, 16, 46, 54, 63, 69, 124)),
    *((3, seed) for seed in (3, 18, 21, 45, 53, 65, 72)),
]
#: Of these, a box slides and spins on four corners, and its motion is not determined.
UNDETERMINED = {(3, 18), (3, 72)}
#: Certified scenes that are attacked here; the command attacks hundreds.
SAMPLE = [
    *(("any", 2, seed) for seed in range(100, 106)),
    *(("any", 3, seed) for seed in (102, 103)),
    *(("chains", 2, seed) for seed in (0, 1, 3, 5, 6, 7, 9, 10, 11)),
    *(("chains", 3, seed) for seed in range(4)),
]


class TestScenes:
    @pytest.mark.parametrize("dimension", [2, 3])
    def test_overlap_and_touch_at_the_start(self, dimension):
        touching = 0
        for seed in range(60):
            bodies = scene(seed, dimension).model.bodies
            free = [k for k, body in enumerate(bodies) if body.motion == "free"]
            gaps = [
                gap(bodies[i].shape, bodies[i].pose, bodies[k].shape, bodies[k].pose)
                for k in free for i in range(len(bodies)) if i < k
            ]  # fmt: skip
            assert min(gaps, default=1.0) >= -1e-12
            touching += sum(value < 1e-12 for value in gaps)
        assert touching >= 10

    @pytest.mark.parametrize("dimension", [2, 3])
    def test_worlds_by_seed(self, dimension):
        drawn = [scene(seed, dimension) for seed in range(40)]
        again = scene(7, dimension)
        assert again.model.bodies == drawn[7].model.bodies and again.rate == drawn[7].rate
        shapes = {type(body.shape).__name__ for each in drawn for body in each.model.bodies if body.motion == "free"}
        assert len(shapes) == (4 if dimension == 2 else 3)
        assert {body.motion for each in drawn for body in each.model.bodies} == {"free", "fixed", "prescribed"}
        assert all(each.steps % STRIDE == 0 for each in drawn)

    @pytest.mark.parametrize("dimension", [2, 3])
    def test_start_of_rows_with_accumulating_impacts(self, dimension):
        free, shapes = [], set()
        for seed in range(40):
            bodies = chain(seed, dimension).model.bodies
            moving = [body for body in bodies if body.motion == "free"]
            pairs = [(a, b) for k, b in enumerate(bodies) for a in bodies[:k] if "free" in (a.motion, b.motion)]
            gaps = [gap(a.shape, a.pose, b.shape, b.pose) for a, b in pairs]
            assert min(gaps) > -1e-12
            free.append(len(moving))
            shapes |= {type(body.shape).__name__ for body in moving}
        assert set(free) == {2, 3, 4, 5} and len(shapes) == 3


class TestVariants:
    def test_common_ends_of_steps_of_a_variant(self):
        assert math.gcd(OFTENER, STRIDE) == 1

    @pytest.mark.parametrize("dimension", [2, 3])
    def test_all_start_where_the_scene_does(self, dimension):
        for seed in range(12):
            drawn = scene(seed, dimension)
            start = np.array([[body.pose for body in drawn.model.bodies]])
            for name, variant in variants(drawn).items():
                there = np.array([[body.pose for body in variant.model.bodies]])
                apart = distance(variant.model, variant.seen(start, np.zeros(1)), there)
                assert apart[0] < 1e-14, (seed, name)

    def test_a_mirrored_polygon_is_mirrored(self):
        seed = next(s for s in range(40) if any(isinstance(b.shape, Polygon) for b in scene(s, 2).model.bodies))
        drawn = scene(seed, 2)
        k = next(i for i, body in enumerate(drawn.model.bodies) if isinstance(body.shape, Polygon))
        corners = {(-round(x, 12), round(y, 12)) for x, y in drawn.model.bodies[k].shape.vertices}
        mirrored = variants(drawn)["mirrored"].model.bodies[k].shape.vertices
        assert {(round(x, 12), round(y, 12)) for x, y in mirrored} == corners

    def test_samples_of_a_restarted_run(self):
        drawn = scene(3, 2)
        samples = drawn.steps // STRIDE
        settings = Settings.reference(1.0 / drawn.rate)
        whole = Variant(drawn.model, settings).poses(samples)
        again = Variant(drawn.model, settings, restarts=True).poses(samples)
        assert whole.shape == again.shape == (samples + 1, len(drawn.model.bodies), 3)


class TestAttack:
    @pytest.mark.few(6)
    @pytest.mark.parametrize(("kind", "dimension", "seed"), SAMPLE)
    def test_certified_scene_in_all_variants(self, kind, dimension, seed):
        found = attack(seed, dimension, kind)
        assert found.certified, found.conditions
        assert found.defects == ()

    def test_discs_at_rest_between_walls_but_for_round_off(self):
        """Velocities of 1e-14 m/s end without an impulse."""
        drawn = chain(4, 2)
        certificate = certify(drawn.model, Settings.reference(1.0 / drawn.rate), drawn.steps, STRIDE)
        assert certificate.holds, certificate.reasons

    def test_difference_of_some_last_places(self):
        """Of the run that is restarted: 5.6e-15 m, where both bounds together were a hundredth less."""
        assert attack(20221, 2).defects == ()

    @pytest.mark.few(5)
    @pytest.mark.parametrize(("dimension", "seed"), ONCE_REFUSED)
    def test_laws_in_short_pieces(self, dimension, seed):
        drawn = scene(seed, dimension)
        certificate = certify(drawn.model, Settings.reference(1.0 / drawn.rate), drawn.steps, STRIDE)
        refused = set(conditions(certificate))
        assert "shared" in refused if (dimension, seed) in UNDETERMINED else refused == set()

    @pytest.mark.parametrize("dimension", [2, 3])
    def test_defect_of_a_variant_of_another_world(self, monkeypatch, dimension):
        """Gravity a millionth stronger: each of both runs is certified, and one of them must be wrong."""

        def other(drawn):
            stronger = tuple(1.000001 * g for g in drawn.model.gravity)
            return {"stronger": Variant(replace(drawn.model, gravity=stronger), Settings.reference(1.0 / drawn.rate))}

        monkeypatch.setattr(trial, "variants", other)
        seed = {2: 3, 3: 0}[dimension]
        found = attack(seed, dimension)
        assert found.certified and found.farthest == "stronger"
        (name, t, apart, allowed), = found.defects  # fmt: skip
        assert name == "stronger" and t > 0.0 and apart > allowed > 0.0

    def test_refused_variant(self, monkeypatch):
        """Fixed steps are no truth: they differ, and their own certificate says so."""

        class Coarse(Variant):
            def poses(self, samples):
                run = Simulation(self.model, Settings.fixed_step(self.settings.dt))
                return run.record(samples * self.stride, self.stride).pose

            def certified(self, samples):
                found = super().certified(samples)
                return replace(found, holds=False, findings=(replace_finding(found.findings[0]),))

        def replace_finding(finding):
            return finding._replace(value=2.0 * finding.limit + 1.0)

        monkeypatch.setattr(
            trial, "variants", lambda drawn: {"coarse": Coarse(drawn.model, Settings.reference(1.0 / drawn.rate))}
        )
        found = attack(3, 2)
        assert found.certified and found.defects == ()
        assert list(found.refused_variants) == ["coarse"] and len(found.refused_variants["coarse"]) == 1

    def test_reason_and_variants_of_a_refused_scene(self):
        """A box comes down, as prescribed, on a disc over the floor: friction of both holds it there."""
        found = attack(13, 2)
        (reason,) = found.conditions
        assert not found.certified and "crushed" in reason
        assert found.off == math.inf and found.farthest in TOLERANCES
