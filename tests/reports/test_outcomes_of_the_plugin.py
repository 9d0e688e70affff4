"""What pytest says of a check, of each verdict and standing there is; and which cells run for it, when."""

from types import SimpleNamespace

import pytest

from reports import testing
from reports.command.completion import row_ids
from reports.testing import Failed, Plugin, _Check, _report
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.judging.verdicts import Physics, Standing

SLOT = Slot("impact", (("e", 0.5),), 2, "chipmunk", "default", 1 / 240)
PASS, FAIL = Physics.PASS.value, Physics.FAIL.value


def row(physics, standing=None, reason="so it is", outcome="ok"):
    return SimpleNamespace(
        physics=physics, standing=standing and standing.value, reason=reason, outcome=outcome, value=1.0, truth=2.0,
        tolerance=0.1, engine_version="1.0",
    )  # fmt: skip


def listed(holds):
    """A finding of some releases, this one among them or not."""
    return SimpleNamespace(family=SimpleNamespace(holds_for=lambda version: holds, releases=">=2", reason="it is soft"))


@pytest.fixture
def asked(monkeypatch):
    """`asked(row, finding, mended)`: how a check of that row ends, and what it leaves."""

    def ask(found, finding=None, mended=False):
        monkeypatch.setattr(testing, "finding_of", lambda own: finding)
        monkeypatch.setattr(testing, "mended", lambda own: mended)
        monkeypatch.setattr(testing, "_report", lambda own: "its report")
        plugin = SimpleNamespace(mended=[], row_of=lambda slot, metric: found)
        item = SimpleNamespace(plugin=plugin, slot=SLOT, metric="speed", name="cell::speed", user_properties=[])
        try:
            _Check.runtest(item)
        except (Failed, pytest.skip.Exception, pytest.xfail.Exception) as error:
            return type(error).__name__, str(error), item
        return "passed", "", item

    return ask


@pytest.mark.parametrize(
    ("found", "finding", "how", "said"),
    [
        (row(PASS), None, "passed", ""),
        (row(PASS, Standing.DRIFTED), listed(True), "Failed", "its report"),
        (row(FAIL, Standing.NEW), None, "Failed", "its report"),
        (row(FAIL, Standing.DRIFTED), listed(True), "Failed", "its report"),
        (row(FAIL, Standing.KNOWN), listed(True), "XFailed", "so it is"),
        (row(FAIL, Standing.EXPLAINED), None, "XFailed", "so it is"),
        (row(FAIL, Standing.NEW), listed(False), "XFailed", "as listed for >=2: it is soft"),
        (row(FAIL, Standing.KNOWN), listed(False), "XFailed", "so it is"),
        (row(None, Standing.KNOWN), listed(True), "XFailed", "so it is"),
        (row(None, Standing.EXPLAINED), None, "XFailed", "so it is"),
        (row(None, Standing.NEW), listed(False), "Failed", "its report"),  # no answer is a failure
        (row(None, outcome="crashed"), None, "Failed", "its report"),
        (row(None, reason="no boxes", outcome="unsupported"), None, "Skipped", "no boxes"),
        (row(None, reason="not unique", outcome="refused"), None, "Skipped", "not unique"),
        (row(None, Standing.NEW, outcome="refused"), None, "Failed", "its report"),
        (None, None, "Failed", "there is no result of speed: the case did not finish"),
    ],
)  # fmt: skip
def test_outcome_of_a_check_by_result_and_listing(asked, found, finding, how, said):
    ended, told, item = asked(found, finding)
    assert (ended, told) == (how, said)
    numbers = [] if found is None else [("value", 1.0), ("truth", 2.0), ("tolerance", 0.1)]
    assert item.user_properties == numbers and item.plugin.mended == []


def test_listed_failures_that_pass_told_at_the_end(asked):
    assert asked(row(PASS), listed(False), True)[2].plugin.mended == ["cell::speed: so it is"]
    assert asked(row(PASS, reason=""), listed(False), True)[2].plugin.mended == [
        "cell::speed: listed for other releases"
    ]
    said = []
    terminal = SimpleNamespace(section=lambda title: said.append(f"= {title}"), line=said.append)
    Plugin.pytest_terminal_summary(SimpleNamespace(lines=[], asked=0, mended=[]), terminal)
    assert said == []
    Plugin.pytest_terminal_summary(SimpleNamespace(lines=[], asked=0, mended=["one", "two"]), terminal)
    assert said == ["= crosscheck: fixed", "one", "two"]


def test_scene_cells_run_once_for_all_their_checks(monkeypatch):
    other = Slot("stack", (("n", 2.0),), 2, "chipmunk", "default", 1 / 240)
    ran = []

    def run_cells(cells, jobs):
        ran.append((list(cells), jobs))
        return cells

    def rows(run, cells):
        assert run == ""
        return [SimpleNamespace(slot=cell.as_dict(), metric=name, n=n) for cell in cells
                for n, name in enumerate(("speed", "energy", "speed"))]  # fmt: skip

    monkeypatch.setattr(testing, "run_cells", run_cells)
    monkeypatch.setattr(testing, "rows_of", rows)
    plugin = SimpleNamespace(ran=set(), rows={}, slots=[SLOT, other])
    assert Plugin.row_of(plugin, SLOT, "speed").n == 0  # the first of a name
    assert Plugin.row_of(plugin, SLOT, "energy").n == 1 and Plugin.row_of(plugin, SLOT, "height") is None
    assert ran == [([SLOT], 0)]
    assert Plugin.row_of(plugin, other, "energy").n == 1
    assert ran == [([SLOT], 0), ([other], 0)]


def test_report_of_value_truth_and_reproduction():
    plain = {"value": 1.25, "unit": "m/s", "metric": "speed", "reason": ""}
    found = SimpleNamespace(
        value=1.25, truth=2.0, tolerance=0.125, unit="m/s", because="of the step", standing="new", outcome="ok",
        reason="", slot=SLOT.as_dict(), as_dict=lambda: plain,
    )  # fmt: skip
    lines = _report(found).splitlines()
    assert [line.partition(" ")[0] for line in lines] == ["measured", "truth", "tolerance", "standing", "again"]
    assert all(line[11] != " " and line[10] == " " for line in lines)
    assert "1.25" in lines[0] and "2" in lines[1] and lines[2].endswith("0.125 m/s: of the step")
    assert lines[3] == "standing   new" and "impact" in lines[4] and "chipmunk" in lines[4]
    found.value, found.standing, found.outcome = None, None, "crashed"
    assert _report(found).splitlines()[::3] == ["no value   crashed", "standing   crashed"]
    found.reason = "signal 11"
    assert _report(found).splitlines()[::3] == ["no value   signal 11", "standing   crashed: signal 11"]


def test_completion_of_row_names(monkeypatch, tmp_path):
    import reports.exports
    import reports.findings
    import reports.wording

    def load(folder):
        assert folder == tmp_path
        return [SimpleNamespace(as_dict=lambda name=name: name) for name in ("a1", "a2", "b1")]

    def families(rows):
        return [SimpleNamespace(worst=name, engine="mujoco", profile="tuned", scene="stack", metric="depth")
                for name in rows]  # fmt: skip

    monkeypatch.setattr(reports.exports, "load_rows", load)
    monkeypatch.setattr(reports.findings, "families", families)
    monkeypatch.setattr(reports.wording, "row_id", lambda name: name)
    context = SimpleNamespace(params={"out": str(tmp_path)})
    found = row_ids(context, None, "a")
    assert [(each.value, each.help) for each in found] == [(n, "mujoco/tuned stack depth") for n in ("a1", "a2")]
    monkeypatch.setattr(reports.exports, "load_rows", lambda folder: 1 / 0)
    assert row_ids(context, None, "") == []  # a completion must never fail
    told = []
    monkeypatch.setattr(reports.exports, "load_rows", lambda folder: told.append(str(folder)) or [])
    assert row_ids(SimpleNamespace(params={}), None, "") == [] and told == ["crosscheck-out"]


class Config:
    """Options of pytest as the plugin reads them."""

    def __init__(self, **options):
        self.options = {"--crosscheck": "chipmunk", "--scenes": "", "--crosscheck-profile": ""} | options

    def getoption(self, name):
        return self.options[name]


def test_plugin_cells_from_a_comma_separated_list(monkeypatch):
    asked = []
    found = SimpleNamespace(engine=object(), version="7.3", reason="")
    monkeypatch.setattr(testing.registry, "find", lambda name: found if name == "chipmunk" else None)
    monkeypatch.setattr(testing, "slots", lambda request: asked.append(request) or [SLOT, SLOT])
    options = {"--scenes": "impact, bounce,impact", "--crosscheck-profile": " tuned ,, default"}
    plugin = Plugin(Config(**options))
    assert (plugin.engine, plugin.version, plugin.slots) == ("chipmunk", "7.3", [SLOT, SLOT])
    assert (plugin.rows, plugin.ran, plugin.mended) == ({}, set(), [])
    assert plugin.pytest_report_header() == "crosscheck: chipmunk 7.3, 2 cases"
    (request,) = asked
    assert (request.scenes, request.engines, request.profiles) == (
        ["impact", "bounce"], ["chipmunk"], ["tuned", "default"]
    )  # fmt: skip
    Plugin(Config())
    assert asked[1].scenes == list(CATALOGUE) and asked[1].profiles == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"--crosscheck": "absent"}, "crosscheck: engine: absent is not installed: no wheel"),
        ({"--scenes": "nobody"}, "crosscheck: scene: there is no scene called 'nobody'"),
    ],
)
def test_plugin_error_for_an_absent_engine_or_unknown_scene(monkeypatch, options, said):
    found = {"absent": SimpleNamespace(engine=None, version="", reason="no wheel")}
    sound = SimpleNamespace(engine=object(), version="7.3", reason="")
    monkeypatch.setattr(testing.registry, "find", lambda name: found.get(name, sound))
    with pytest.raises(pytest.UsageError) as refused:
        Plugin(Config(**options))
    assert str(refused.value).startswith(said)


def test_check_found_by_words_of_its_cell(monkeypatch):
    """``pytest -k`` knows the scene, the profile and the metric, and all of them together."""
    monkeypatch.setattr(pytest.Item, "__init__", lambda self, **named: setattr(self, "extra_keyword_matches", {"own"}))
    item = object.__new__(_Check)
    plugin = object()
    _Check.__init__(item, plugin, SLOT, "speed")
    assert (item.plugin, item.slot, item.metric) == (plugin, SLOT, "speed")
    assert item.extra_keyword_matches == {"own", "crosscheck", "impact", "default", "speed"}
