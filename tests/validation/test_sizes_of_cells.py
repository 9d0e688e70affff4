"""What no machine finishes is refused from the first step too many; moved starts; settings that are switched."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.engine import Setting
from adapters.scene import Body, Disc, HalfSpace, Scene, SceneError, Sphere
from validation import cells
from validation.cells import LONGEST_DT, MOST_SAMPLES, MOST_STEPS, Slot, check_size

FLOOR = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
BALL = Body("ball", Disc(0.5), 1.0, 0.1, (2.0, 1.0, 0.25))


def scene(duration, count=1):
    bodies = tuple(replace(BALL, name=f"ball{k}", pose=(2.0 * k, 1.0, 0.0)) for k in range(count))
    return Scene("own", 1, 2, bodies, (), (0.0, -9.81), duration)


def test_largest_step_length_and_counts_of_steps_and_samples():
    def refused(scene, dt):
        with pytest.raises(SceneError) as error:
            check_size(scene, dt)
        return str(error.value)

    check_size(scene(1.0), LONGEST_DT)
    longer = refused(scene(1.0), math.nextafter(LONGEST_DT, 1.0))
    assert longer.endswith(f"s is longer than {LONGEST_DT:g} s: nothing can be measured at it")
    dt = 2.0**-20
    check_size(scene(MOST_STEPS * dt), dt)
    said = refused(scene((MOST_STEPS + 1.0) * dt), dt)
    assert said == f"dt: 1/1048576 makes {MOST_STEPS:.3g} steps of {MOST_STEPS * dt:g} s, at most {MOST_STEPS:g}"
    many = 2 * math.ceil(MOST_SAMPLES / MOST_STEPS)
    most = MOST_SAMPLES / many
    check_size(scene(most * dt, many), dt)
    said = refused(scene((most + 1.0) * dt, many), dt)
    assert said == (
        f"dt: 1/1048576 makes {most:.3g} steps of {many} bodies; steps times bodies are at most {MOST_SAMPLES:g}"
    )


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_free_bodies_started_some_units_of_precision_off(kind):
    flat = Scene("own", 1, 2, (FLOOR, BALL), (), (0.0, -9.81), 1.0)
    unit = float(np.finfo(kind).eps)
    for ulp, height in ((0, 1.0), (1, 1.0 + unit), (3, 1.0 + 3.0 * unit), (-1, 1.0 - unit / 2), (-2, 1.0 - unit)):
        moved = cells._nudged(flat, ulp, kind)
        assert moved == replace(flat, bodies=(FLOOR, replace(BALL, pose=(2.0, height, 0.25))))
    ball = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (4.0, 2.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    deep = Scene("own", 1, 3, (ball,), (), (0.0, 0.0, -9.81), 1.0)
    assert cells._nudged(deep, 1, kind).bodies[0].pose == (4.0, 2.0, 1.0 + unit, 1.0, 0.0, 0.0, 0.0)


def test_settings_of_profile_or_model_with_replacements(monkeypatch):
    own, asked = [Setting("a", 1, "as shipped"), Setting("b", 2.0, "as shipped")], []
    engine = SimpleNamespace(settings=lambda *given: (asked.append(given), own)[1])
    slot = Slot("stack", (), 2, "toy", "tuned", 1 / 240, 7)
    flat = Scene("own", 1, 2, (FLOOR, BALL), (), (0.0, -9.81), 1.0)
    assert cells.settings_of(engine, slot, flat) == own
    assert asked == [("tuned", cells.needs(flat), 1 / 240, 7)]
    why = "switched for an experiment"
    switched = replace(slot, switched=(("b", 5.0), ("c", "on")))
    assert cells.settings_of(engine, switched, flat) == [own[0], Setting("b", 5.0, why), Setting("c", "on", why)]
    model = SimpleNamespace(settings=(Setting("m", 3, "of the model"),))
    brought = {("toy", "tuned"): model}
    posed = SimpleNamespace(brought=lambda *who: brought.get(who))
    monkeypatch.setattr(cells, "resolve", lambda name: posed)
    asked.clear()
    assert cells.settings_of(engine, slot, flat) == list(model.settings) and asked == []
    assert cells.settings_of(engine, replace(slot, profile="default"), flat) == own
    monkeypatch.setattr(cells, "is_known", lambda name: False)
    assert cells.settings_of(engine, slot, flat) == own  # the bench's own scenes bring nothing
