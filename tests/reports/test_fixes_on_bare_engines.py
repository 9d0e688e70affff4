"""Every printed fix was run: pasted into a model of the engine alone, with names, sizes and a step of its own."""

import html
import random
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bare import LENGTH, MASS, STEP, run

from reports.fixes import cure_paste
from validation.cells import plane_of
from validation.fixes.kept import cures_of
from validation.fixes.panel import is_broken, other_cases
from validation.metrics import OUT_OF_PLANE
from validation.posed import resolve
from validation.running.plan import QUICK_DT

#: Sizes, masses and step of a model: the scene's own, and others.
SAME, OTHER = (1.0, 1.0, QUICK_DT), (LENGTH, MASS, STEP)
PACKAGES = {"mujoco": "mujoco", "bullet": "pybullet", "chipmunk": "pymunk"}
#: How many fixes the short tests draw.
DRAWN = 12
PAGE = Path(__file__).parents[2] / "reports" / "published" / "report.html"

CURES = {(engine, *key): cure for engine in PACKAGES for key, cure in cures_of(engine).items() if cure.changes}
#: Drawn anew with every table: which ones depends on all that is printed.
CHOSEN = random.Random(str(sorted(CURES))).sample(sorted(CURES), DRAWN)


def judged(engine, scene, dimension, params, paste, size):
    """Error over tolerance of every check, by metric; None where the model gives no number."""
    length, mass, step = size
    canonical = resolve(scene)
    asked = canonical.scene(dimension, dict(params))
    found = run(engine, asked, paste, length, mass, step)
    measured = canonical.measure(asked, found) | {OUT_OF_PLANE: (found.out_of_plane, "")}
    plane = [] if found.out_of_plane is None else plane_of(canonical, asked, found.dt)
    errors = {}
    for check in [*canonical.checks(asked, found.dt), *plane]:
        if check.truth is not None and check.bound:
            value, _ = measured.get(check.metric, (None, ""))
            errors[check.metric] = None if value is None else abs(value - check.truth) / check.bound
    return errors


def kind_of(metric):
    return metric.partition("[")[0]


def fails(error):
    return error is None or not error <= 1.0


@pytest.mark.parametrize(
    "key",
    [pytest.param(key, id="-".join(map(str, key)), marks=[] if key in CHOSEN else pytest.mark.long) for key in CURES],
)
def test_listed_cures_on_bare_models(key):
    """What it says is mended is, and what it tells fails without it; in other sizes by the formulas beside numbers."""
    cure = CURES[key]
    pytest.importorskip(PACKAGES[cure.engine])
    kinds = cure.mends or (kind_of(cure.metric),)
    paste = cure_paste(cure)
    asked = (cure.engine, cure.scene, cure.dimension, cure.params)
    for size in (SAME, OTHER):
        before, after = (
            {m: e for m, e in judged(*asked, lines, size).items() if kind_of(m) in kinds or m == cure.metric}
            for lines in ("", paste)
        )
        assert not {metric: error for metric, error in after.items() if fails(error)}, size
        assert size == OTHER or any(map(fails, before.values()))


@pytest.mark.parametrize("case", ["a thrown ball", "a bouncy body at rest"])
@pytest.mark.parametrize("engine", ["mujoco", "bullet"])
def test_bounce_fix_pasted_into_another_scene(engine, case):
    """What its line says of other cases is what happens there, without our adapter."""
    pytest.importorskip(PACKAGES[engine])
    cure, slot = CURES[engine, "bounce", 3], dict(other_cases(engine, "default"))[case]
    where = (engine, slot.scene, slot.dimension, slot.params)
    before, after = (judged(*where, paste, (1.0, 1.0, slot.dt)) for paste in ("", cure_paste(cure)))
    broken = {kind_of(metric) for metric, error in after.items() if is_broken(before[metric], error)}
    assert broken == {kind_of(cost.metric) for cost in cure.panel.breaks if cost.case == case}


def pastes(page):
    """Engine, scene, check, parameters and lines of every fix on a page."""
    pattern = r"<summary>(\w+) on (\w+): (\S+?)(?: at (\w+=\S+(?: \w+=\S+)*))? \S+(?: [^<]*)?</summary>(.*?)"
    pattern += r"(?=<details class=[\"']?cure|\Z)"
    for engine, scene, metric, at, rest in re.findall(pattern, page, re.DOTALL):
        lines = re.search(r'aria-label="Cure of [^"]*">(.*?)</pre>', rest, re.DOTALL)
        params = {name: float(value) for name, value in re.findall(r"(\w+)=([-\d.e+]+)", at)}
        if lines:
            yield engine, scene, metric, params, html.unescape(lines[1])


def check_page(engine, scene, metric, params, paste):
    pytest.importorskip(PACKAGES[engine])
    canonical = resolve(scene)
    stating = (d for d in canonical.dimensions for c in canonical.checks(canonical.scene(d, params), QUICK_DT)
               if c.metric == metric)  # fmt: skip
    dimension = next(stating, 2)  # the plane of a lifted scene is no check of the scene itself
    for size in (SAME, OTHER):
        before, after = (judged(engine, scene, dimension, params, lines, size)[metric] for lines in ("", paste))
        assert not fails(after) or (before is None or after < before), (size, before, after)


PUBLISHED = list(pastes(PAGE.read_text(encoding="utf-8")))


@pytest.mark.long
@pytest.mark.parametrize("shown", [pytest.param(shown, id="-".join(shown[:2])) for shown in PUBLISHED])
def test_published_fixes_on_bare_models(shown):
    if "priority=" not in "".join(paste for *_, paste in PUBLISHED):
        pytest.skip("the published page is of before its fixes were run: make publish")
    check_page(*shown)


# ---- what the tests above rest on ------------------------------------------------------------------------------------


def lifted(body):
    """The body 1 m higher, if it is free: it touches nothing while it falls."""
    return body if body.motion != "free" else replace(body, pose=(body.pose[0], body.pose[1] + 1.0, *body.pose[2:]))


@pytest.mark.parametrize(("engine", "scene"), [("mujoco", "slide"), ("bullet", "slide"), ("chipmunk", "slide")])
def test_fall_of_a_bare_model_at_any_size(engine, scene):
    """A model in other sizes is told in the scene's own units."""
    pytest.importorskip(PACKAGES[engine])
    canonical = resolve(scene)
    asked = replace(canonical.scene(2, {}), pairs=(), duration=0.05)
    asked = replace(asked, bodies=tuple(lifted(body) for body in asked.bodies))
    for length, mass, step in (SAME, OTHER):
        found = run(engine, asked, "", length, mass, step)
        assert found.pose.shape[1:] == (len(asked.bodies), 3) and found.dt == pytest.approx(step / length**0.5)
        assert found.pose[0] == pytest.approx(np.array([body.pose for body in asked.bodies]), abs=1e-12)
        assert found.twist[0] == pytest.approx(np.array([body.twist for body in asked.bodies]), abs=1e-12)
        fallen = asked.bodies[-1].pose[1] - found.pose[-1, -1, 1] + asked.bodies[-1].twist[1] * found.t[-1]
        # g t^2/2, to the half step of gravity by which orders of a step differ.
        assert fallen == pytest.approx(-0.5 * asked.gravity[1] * found.t[-1] ** 2, abs=10.0 * found.t[-1] * found.dt)
