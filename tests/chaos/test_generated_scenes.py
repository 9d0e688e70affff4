"""Generated scene files: valid ones run ten steps on every engine, spoilt ones parse or are refused with the field."""

import json
import os
import re
from collections import Counter

import jsonschema
import pytest
from generated_scenes import mutated, valid

from adapters import registry
from adapters.plain import is_visible, one_line
from adapters.scene import SceneError
from validation.cells import Outcome
from validation.files.scene_files import json_schema, stated_from_text
from validation.files.scene_format import SceneModel
from validation.running.plan import Request, slots
from validation.workers import run_cells

STEPS, DT = 10, 1.0 / 240.0


def fields_of(data):
    """What the path of a field may begin with: fields of the format, keys of the file, names of its bodies, a pair."""
    yield from (*SceneModel.model_fields, "file", "pair ")
    if isinstance(data, dict):
        yield from (one_line(key) for key in data if key)
        for body in data["bodies"] if isinstance(data.get("bodies"), list) else ():
            if isinstance(body, dict) and isinstance(body.get("name"), str) and body["name"]:
                yield one_line(body["name"], 60).rstrip(" .")


@pytest.mark.timeout(7200)
def test_valid_scenes_on_every_engine_for_ten_steps(dice, soak, every, tmp_path):
    engines = [name for name in registry.names() if registry.find(name).engine is not None]
    cells, files = [], int(os.environ.get("CROSSCHECK_FILES", 500)) if soak else 25 if every else 3
    for number in range(files):
        path = tmp_path / f"scene-{number}.json"
        path.write_text(json.dumps(valid(dice, STEPS, DT)))
        cells += slots(Request([str(path)], engines, dts=[DT]))
    found = list(run_cells(cells, jobs=2, timeout=300.0))
    assert sorted(o.slot.key() for o in found) == sorted(slot.key() for slot in cells)
    print(Counter((o.slot.engine, o.outcome.value) for o in found))
    # Names and numbers aside: what engines cannot be asked, and how often.
    print(Counter((o.slot.engine, re.sub(r"^[^:]*: |[0-9.+-]+", "", o.reason)) for o in found
                  if o.outcome is Outcome.UNSUPPORTED))  # fmt: skip
    print(Counter((o.slot.engine, o.slot.profile, re.sub(r"[0-9.e+-]+", "", o.reason)) for o in found
                  if o.outcome is Outcome.REFUSED))  # fmt: skip
    allowed = (Outcome.OK, Outcome.UNSUPPORTED, Outcome.REFUSED, Outcome.INVALID, Outcome.DIVERGED)
    ended = [(o.slot.engine, o.slot.profile, o.slot.scene, o.reason) for o in found if o.outcome not in allowed]
    assert not ended, ended[:5]
    assert all(len(o.reason.splitlines()) <= 1 and "Traceback" not in o.reason for o in found)
    assert sum(o.outcome is Outcome.OK for o in found) > len(found) // 3


def test_valid_scenes_parsed_and_spoilt_ones_refused_by_field(dice, soak, tmp_path):
    """The schema says of a valid file that it is; of every refusal the field is named."""
    checker = jsonschema.Draft202012Validator(json_schema())
    parsed = refused = 0
    for _ in range(10_000 if soak else 300):
        data = valid(dice, STEPS, DT)
        assert not [error.message for error in checker.iter_errors(json.loads(json.dumps(data)))]
        stated_from_text(json.dumps(data), tmp_path / "valid.json")
        spoilt = mutated(data, dice)
        try:
            stated_from_text(json.dumps(spoilt), tmp_path / "spoilt.json")
            parsed += 1
        except SceneError as error:
            said = str(error)
            assert is_visible(said) and len(said.splitlines()) == 1 and len(said) < 6000
            assert said.partition(": ")[2].startswith(tuple(fields_of(spoilt))), said
            refused += 1
    assert parsed and refused
