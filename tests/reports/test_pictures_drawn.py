"""What every picture of the page owes, asked of the specifications that are drawn."""

import math

import pytest
import vl_convert

from reports.page import render

#: Channels that place a mark, and those that place its other end.
ACROSS, UP = {"x", "x2"}, {"y", "y2"}


@pytest.fixture(scope="module")
def drawn(page_source):
    """Specifications of all pictures of the page, in the order in which they are drawn."""
    found, draw = [], vl_convert.vegalite_to_svg
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vl_convert, "vegalite_to_svg", lambda spec: found.append(spec) or draw(spec))
        render(page_source)
    assert len(found) > 5
    return found


def layers(spec, above=None):
    """Every mark with its encoding and its rows: what a layer does not say, it has from above."""
    above = above or {"encoding": {}, "data": None, "made": set()}
    made = {name for step in spec.get("transform", ()) for name in [step.get("as")] if isinstance(name, str)}
    own = {
        "encoding": above["encoding"] | spec.get("encoding", {}),
        "data": spec.get("data", above["data"]),
        "made": above["made"] | made,
    }
    for part in ("layer", "concat", "hconcat", "vconcat"):
        for inner in spec.get(part, ()):
            yield from layers(inner, own)
    if "spec" in spec:
        yield from layers(spec["spec"], own)
    if "mark" in spec:
        mark = spec["mark"]
        yield (mark if isinstance(mark, str) else mark["type"]), own


def rows_of(spec, own):
    data = own["data"] or {}
    return data.get("values") if "values" in data else spec.get("datasets", {}).get(data.get("name"), [])


def fields(encoding):
    """Names of columns that an encoding asks for."""
    for channel, said in encoding.items():
        for each in said if isinstance(said, list) else [said]:
            if isinstance(each, dict) and isinstance(each.get("field"), str):
                yield channel, each["field"]


def test_columns_of_pictures(drawn):
    """Vega draws nothing, without a word, where a column is missing."""
    for spec in drawn:
        for mark, own in layers(spec):
            rows = rows_of(spec, own)
            known = {name for row in rows for name in row} | own["made"]
            missing = [(channel, name) for channel, name in fields(own["encoding"]) if rows and name not in known]
            assert not missing, (mark, missing, sorted(known))


def test_every_mark_has_a_place_in_both_directions(drawn):
    """But for rules across the whole picture; and nothing that is said to be encoded is left open."""
    for spec in drawn:
        for mark, own in layers(spec):
            said = {channel for channel, told in own["encoding"].items() if told is not None}
            assert said == set(own["encoding"]), (mark, own["encoding"].keys() - said)
            assert said & ACROSS or said & UP, mark
            if mark not in ("rule", "rect"):
                assert said & ACROSS and said & UP, (mark, said)


def test_numbers_within_axes_of_a_picture(drawn):
    """A mark outside is cut off or drawn over the words; and a logarithm needs a positive number."""
    looked = 0
    for spec in drawn:
        for mark, own in layers(spec):
            for channel in ("x", "y"):
                told = own["encoding"].get(channel)
                scale = told.get("scale") if isinstance(told, dict) else None
                if not isinstance(scale, dict) or len(scale.get("domain", ())) != 2 or "field" not in told:
                    continue
                low, high = sorted(scale["domain"])
                for row in rows_of(spec, own):
                    value = row.get(told["field"])
                    if isinstance(value, int | float) and math.isfinite(value):
                        looked += 1
                        assert low <= value <= high, (mark, channel, told["field"], value)
    assert looked > 50
