"""What an engine does when nothing is set: experiments on a world that is known, and engines beside their documents."""

import json
import math

import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters import registry, unset
from adapters.engine_folder import unset_of
from adapters.unset import FRICTIONS, RADIUS, RESTITUTIONS, Asked, Told, Unset
from reports import listing, tables
from reports.command import main
from validation.running.warming import MARK

#: Ports do what their originals do.
OURS = [name for name in registry.names() if (told := registry.adapter(name)) and not told.facts.port_of]
HERE = [name for name in OURS if registry.find(name).engine is not None]


class Known:
    """A body by closed forms, step by step: Coulomb's friction, Newton's restitution, drag, sleep, a slop."""

    dt, mu, e, least, drag, asleep, slop = 1.0 / 240.0, 0.3, 0.25, 0.5, 0.2, 0.75, 0.03
    g = 1.6

    def __init__(self, asked):
        self.gap, self.along, self.up, self.spin = asked.gap, asked.along, asked.up, asked.spin
        self.gravity = self.g if asked.gravity is None else asked.gravity
        self.friction = self.mu if asked.friction is None else min(asked.friction)
        self.restitution = self.e if asked.restitution is None else sum(asked.restitution) / 2
        self.time = 0.0

    def advance(self, steps):
        for _ in range(steps):
            self.time += self.dt
            keeps = math.exp(-self.drag * self.dt)
            self.along, self.up, self.spin = self.along * keeps, self.up * keeps, self.spin * keeps
            if abs(self.along) < 0.01 and self.time > self.asleep:
                self.along = 0.0
            before, self.up = self.up, self.up - self.gravity * self.dt
            if self.gap <= 0.0 and self.up < 0.0:
                impact = before < -self.least
                after = -self.restitution * before if impact else 0.0
                taken = self.friction * (after - self.up)
                self.along = math.copysign(max(0.0, abs(self.along) - taken), self.along)
                self.up = after
            self.gap += self.up * self.dt
            if self.gap < -self.slop:
                self.gap = min(-self.slop, self.gap + 0.01)

    def told(self):
        return Told(self.gap, self.along, self.up, self.spin)


class Supported(Known):
    """The same without friction, and only what touches the ground falls asleep."""

    mu = 0.0

    def __init__(self, asked):
        super().__init__(asked)
        self.asleep = Known.asleep if asked.gap <= 0.0 else math.inf


def test_engine_defaults_found_by_experiments_in_a_known_world():
    # Drag falls on the way, by what friction takes of the speed: half of that is missed.
    missed = 0.5 * Known.drag * unset.SLIDE_TIME
    assert unset.friction(Known) == pytest.approx(0.3, rel=1.1 * missed)
    assert unset.friction(Known, FRICTIONS) == pytest.approx(0.2, rel=1.1 * missed)
    assert unset.restitution(Known) == pytest.approx(0.25, rel=5e-3)
    assert unset.restitution(Known, RESTITUTIONS) == pytest.approx(0.65, rel=5e-3)
    # One part of 2^11 of a ratio of 1e4, and what drag takes of the way.
    assert unset.least_rebound(Known) == pytest.approx(0.5, rel=5e-3 + Known.drag * Known.dt)
    assert unset.damping(Known, "along") == pytest.approx(0.2) == pytest.approx(unset.damping(Known, "spin"))
    assert unset.sleep(Known) == pytest.approx(0.75, abs=2 * Known.dt)
    assert unset.sleep(Supported) == math.inf and unset.sleep(Supported, rolls=True) == pytest.approx(0.75, abs=0.01)
    assert unset.gravity(Known) == pytest.approx(-1.6)
    assert abs(unset.rest(Known)) < 1e-9 and unset.left(Known) == pytest.approx(0.03)
    assert unset.reach(lambda gap: gap < 0.02) == pytest.approx(0.02, abs=RADIUS / 2**11)
    assert unset.reach(lambda gap: False) == 0.0


@pytest.mark.parametrize(
    ("changed", "measure", "expected"),
    [({"least": 0.0}, unset.least_rebound, 0.0), ({"asleep": math.inf}, unset.sleep, math.inf),
     ({"drag": 0.0}, lambda make: unset.damping(make, "along"), 0.0), ({"e": 0.0}, unset.restitution, 0.0),
     ({"mu": 0.0}, unset.friction, 0.0)],
)  # fmt: skip
def test_default_without_a_mechanism_measured_as_none(changed, measure, expected):
    assert measure(type("Other", (Known,), changed)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("engine", OURS)
def test_engine_defaults_with_nothing_set_and_their_source(engine):
    rows = unset_of(engine)
    assert len({row.what for row in rows}) == len(rows) >= 5
    assert all(row.documented and row.source for row in rows)
    for row in rows:  # a number in words is the number that is compared
        first = row.documented.split()[0].rstrip(",:")
        if row.value is not None and first.lstrip("-").replace(".", "", 1).replace("e-", "", 1).isdigit():
            assert float(first) == pytest.approx(row.value, abs=5e-4), row.what
    assert any("friction of" in row.what for row in rows) and any("restitution of" in row.what for row in rows)


@pytest.mark.parametrize("engine", OURS)
def test_measured_defaults_equal_to_the_documented(engine):
    """A release that does otherwise, or a document that is misread, fails here."""
    if engine not in HERE:
        pytest.skip(f"{engine} is not installed here: {registry.find(engine).reason}")
    measured = [row for row in unset_of(engine) if row.measure is not None]
    for row in measured:
        found = row.measure()
        assert not math.isnan(found), row.what
        if row.value is not None:
            assert found == row.value or abs(found - row.value) <= row.within, (row.what, found, row.value)
    assert len(measured) >= 5 or engine == "newton"


def test_table_of_measured_defaults(monkeypatch):
    rows = (
        Unset("friction of a pair", "0.5", "book, page 1", 0.5, lambda: 0.500001),
        Unset("restitution of a pair", "0", "book, page 2", 0.0, lambda: 0.25),
        Unset("asleep after [s]", "never", "book, page 3", math.inf, lambda: math.inf),
        Unset("step [s]", "none", "book, page 4"),
        Unset("gap [m]", "not documented", "book", None, lambda: 1 / 0),
    )
    monkeypatch.setattr(listing, "unset_of", lambda name: rows)
    monkeypatch.setattr(listing, "_why_unmeasured", lambda name: "")
    told = [listing._unset(row, "") for row in rows]
    assert [row["agrees"] for row in told] == [True, False, True, None, None]
    console = Console(width=80, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    tables._unset({"unset": told}, console)
    text = console.export_text()
    assert "0.25, differs" in text and "never" in text and "ZeroDivisionError" in text
    assert all(len(line.rstrip()) <= 80 for line in text.splitlines())


def test_description_of_an_absent_engine(monkeypatch):
    missing = next((name for name in OURS if name not in HERE), None)
    if missing is None:
        pytest.skip("all engines are installed")
    done = CliRunner().invoke(main, ["describe", missing, "--measure", "--json"])
    told = json.loads(done.output)
    assert told["status"] == "not installed" and told["unset"]
    for row in told["unset"]:
        assert row["measured"] is None and row["reason"] == f"{missing} is not installed here"
    text = CliRunner().invoke(main, ["describe", missing, "--measure"]).output
    assert "When nothing is set" in text and f"not measured: {missing} is not installed here" in text


@pytest.mark.parametrize("engine", [name for name in HERE if registry.load(name).kernels() is None])
def test_describe_measures_on_request_and_lists_settings(engine):
    unmeasured = json.loads(CliRunner().invoke(main, ["describe", engine, "--json"]).output)["unset"]
    assert {(row["measured"], row["reason"]) for row in unmeasured} == {
        (None, f"crosscheck describe {engine} --measure does so")
    }
    told = json.loads(CliRunner().invoke(main, ["describe", engine, "--measure", "--json"]).output)
    assert {row["what"]: row["agrees"] for row in told["unset"]}
    assert all(row["agrees"] is not False for row in told["unset"])
    if engine != "newton":
        assert sum(row["measured"] is not None for row in told["unset"]) >= 5
    assert {each["name"] for each in told["settable"]} == set(registry.load(engine).settable())


def test_description_without_compiling_kernels(monkeypatch, tmp_path):
    engine = registry.load("reference")
    monkeypatch.setattr(type(engine), "kernels", lambda self: tmp_path)
    assert listing._why_unmeasured("reference").endswith("crosscheck compile --engine reference")
    (tmp_path / f"{MARK}1").write_text("{}")
    assert listing._why_unmeasured("reference") == ""


def test_body_at_its_requested_position():
    assert Asked("ball", 0.25).height == 0.75 and Asked("box", 0.25).height == 0.35
