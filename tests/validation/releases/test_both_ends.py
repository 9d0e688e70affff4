"""What goes over the line to an environment and back, without one between both ends."""

import io
import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.records.store import Store
from validation.releases import driven as other_end
from validation.releases import driving
from validation.releases.driving import Effort, drive

ONE = Effort(jobs=1)


@pytest.fixture
def store(tmp_path):
    found = Store(tmp_path / "out")
    yield found
    found.close()


def test_what_a_release_answers_and_what_it_left_comes_over_the_line_as_it_is(store, monkeypatch):
    """Both ends of the line, without an environment between them: one cell ran, one was left with a reason."""
    asked = [Slot("impact", (("e", e),), 2, "chipmunk", "default", 1 / 240) for e in (0.25, 0.5)]
    own = SimpleNamespace(name="chipmunk==1", engine="chipmunk", version="1", distribution="pymunk", unknown="")
    seen = Observation(asked[0], "c0de", 120, "9.9", Outcome.OK, "", state_hash="0a")

    def cells(wanted, jobs, timeout, leave):
        assert (list(wanted), jobs, timeout) == (asked, ONE.jobs, ONE.timeout)
        yield seen
        leave(wanted[1], "it ran out of time\nthree times")

    def talk(environment, path, question, patience):
        yield {"told": {"distribution_version": "1", "reason": ""}}
        said = io.StringIO()
        other_end._run(said, json.loads(json.dumps(question)))
        yield from map(json.loads, said.getvalue().splitlines())

    monkeypatch.setattr(other_end, "run_cells", cells)
    monkeypatch.setattr(driving, "build", lambda release, say: None)
    monkeypatch.setattr(driving, "code", lambda engine, scenes: "")
    monkeypatch.setattr(driving, "_talk", talk)
    ran, left = drive(store, own, asked, ONE)
    assert ran == replace(seen, engine_version="1")
    assert left == Observation(asked[1], "", 0, "1", Outcome.TIMED_OUT, "it ran out of time")
