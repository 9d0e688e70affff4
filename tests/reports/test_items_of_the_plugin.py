"""Which checks of which cells become items of pytest, under which names; how a failure is shown."""

from types import SimpleNamespace

import pytest

from reports import testing
from reports.testing import Failed, Plugin, _Cells, _Check
from validation.cells import Slot, plane_of
from validation.posed import resolve

SLOTS = [
    Slot("impact", (("e", 0.5),), 2, "toy", "tuned", 1 / 240),
    Slot("stack", (("n", 2.0),), 2, "toy", "tuned", 1 / 60, 4),
    Slot("impact", (), 3, "toy", "default", 1 / 240),
]


@pytest.fixture
def items(monkeypatch):
    """`items(dimensions)`: items of an engine that knows these."""
    monkeypatch.setattr(_Check, "from_parent", lambda parent, **given: given)

    def collect(dimensions):
        facts = dimensions and SimpleNamespace(dimensions=dimensions)
        monkeypatch.setattr(testing.registry, "facts", lambda engine: facts if engine == "toy" else None)
        return list(_Cells.collect(SimpleNamespace(plugin=SimpleNamespace(engine="toy", slots=SLOTS, core=[]))))

    return collect


def test_plugin_items_of_checks_with_a_tolerance(items):
    cells = ("toy/tuned/impact 2-D e=0.5", "toy/tuned/stack 2-D n=2 iterations=4", "toy/default/impact 3-D")
    wanted, lifted = [], []
    for slot, cell in zip(SLOTS, cells, strict=True):
        canonical = resolve(slot.scene)
        scene = canonical.scene(slot.dimension, dict(slot.params))
        own = [each.metric for each in canonical.checks(scene, slot.dt) if each.bound is not None]
        plane = [each.metric for each in plane_of(canonical, scene, slot.dt)]
        assert own and bool(plane) is (slot.dimension == 2)
        wanted += [(f"{cell}::{metric}", slot, metric) for metric in own]
        lifted += [(f"{cell}::{metric}", slot, metric) for metric in [*own, *plane]]
    for dimensions, told in (({2, 3}, wanted), ({2}, wanted), ({3}, lifted), (None, wanted)):
        found = items(dimensions)
        assert [(each["name"], each["slot"], each["metric"]) for each in found] == told
        assert all(each["plugin"].engine == "toy" and len(each) == 4 for each in found)


def test_plugin_items_after_the_existing_tests(monkeypatch):
    asked = []

    def from_parent(session, **given):
        asked.append((session, given))
        return SimpleNamespace(collect=lambda: iter(["item"]))

    monkeypatch.setattr(_Cells, "from_parent", from_parent)
    plugin, found = object.__new__(Plugin), ["a test"]
    plugin.pytest_collection_modifyitems("a session", found)
    assert found == ["a test", "item"]
    assert asked == [("a session", {"name": "crosscheck", "nodeid": "crosscheck", "plugin": plugin})]


def test_plugin_report_of_a_failure_and_an_error(monkeypatch):
    item = SimpleNamespace(name="a cell::speed")
    assert _Check.repr_failure(item, SimpleNamespace(value=Failed("its report"))) == "its report"
    monkeypatch.setattr(pytest.Item, "repr_failure", lambda self, excinfo, style=None: f"trace of {excinfo.value}")
    other = object.__new__(_Check)
    assert _Check.repr_failure(other, SimpleNamespace(value=ValueError("slip"))) == "trace of slip"
    assert _Check.reportinfo(item) == ("crosscheck", None, "a cell::speed")
