"""Releases are asked in their environments, and what they say is kept with their version."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from adapters import registry
from validation.cells import Outcome, Slot
from validation.judging.rows import rows_of
from validation.posed import pinned
from validation.releases import environments, history
from validation.releases.choosing import RegistryError, chosen, offered
from validation.releases.driving import Effort, answered, drive, planned
from validation.running.plan import Request

ONE = Effort(jobs=1)
REQUEST = Request(scenes=["impact"], engines=["toy"], dimensions=[2], params={"e": 0.5, "v": 4.0})
SLOT = Slot("impact", (("e", 0.5), ("v", 4.0)), 2, "toy", "default", 1 / 240)


def release(version):
    return chosen("toy", version)[0]


def ask(store, version, slots=(SLOT,), effort=ONE, **kwargs):
    return drive(store, release(version), slots, effort, **kwargs)


def test_cells_of_an_answering_release_without_one_installed(toy):
    assert registry.find("toy").engine is None
    found = planned(chosen("toy", "1.0.0,1.1.0"), REQUEST, ONE, lambda line: None)
    assert found == [SLOT]


def test_release_stored_under_its_version_and_never_latest(toy, store, monkeypatch):
    latest, _ = store.start("quick: impact", [SLOT])
    (observation,) = ask(store, "1.0.0")
    assert (observation.outcome, observation.engine_version) == (Outcome.OK, "1.0.0")
    assert observation.metrics["rebound_ratio"][0] == pytest.approx(0.5, abs=1e-12)
    assert all(slip["holds"] for slip in observation.receipts) and observation.receipts
    (run,) = store.release_runs("toy")
    told = store.protocol(run)["told"]
    assert told["distribution_version"] == "1.0.0" and told["numpy"]
    assert store.run("latest").id == latest.id
    # What other code measured does not count.
    assert list(answered(store, release("1.0.0"), [SLOT])) == [SLOT]
    for name in ("scene_code", "adapter_hash"):
        with monkeypatch.context() as other:
            other.setattr(f"validation.releases.driving.{name}", lambda asked: "another")
            assert answered(store, release("1.0.0"), [SLOT]) == {}


def test_planted_change_in_its_release(toy, store):
    fast = replace(SLOT, params=(("e", 0.5), ("v", 10.0)))
    before, after = (ask(store, version, (fast,))[0].metrics["rebound_speed"][0] for version in ("1.0.0", "1.2.0"))
    assert before == pytest.approx(5.0) and after == pytest.approx(3.0)


def test_row_of_a_release_without_import(toy, store):
    (observation,) = ask(store, "1.1.0")
    assert observation.outcome is Outcome.NOT_INSTALLED and observation.engine_version == "1.1.0"
    assert "cannot be imported" in observation.reason and "libtoy.so.1" in observation.reason
    rows = rows_of("toy==1.1.0", [observation])
    assert rows and not any(row.physics or row.alarming for row in rows)


def test_row_of_a_release_without_installation(toy, store):
    (observation,) = ask(store, "1.5.0")
    assert observation.outcome is Outcome.NOT_INSTALLED
    assert "there is no wheel of toyphysics 1.5.0" in observation.reason


@pytest.mark.long
def test_stored_cells_not_asked_again_and_missing_ones_asked(toy, store):
    asked = []
    for version in ("1.0.0", "1.1.0", "1.0.0", "1.1.0"):
        ask(store, version, progress=lambda observation: asked.append(observation.engine_version))
    assert asked == ["1.0.0", "1.1.0", "1.1.0"]
    ask(store, "1.0.0", effort=replace(ONE, fresh=True), progress=lambda o: asked.append("again"))
    assert asked[-1] == "again"


def test_refusal_stored_and_unasked_release_asked_with_try(toy, store):
    refused = Slot("incline", (), 2, "toy", "default", 1 / 240)
    asked = []
    for _ in range(2):
        (found,) = ask(store, "1.0.0", [refused], progress=lambda observation: asked.append(observation.outcome))
        assert found.outcome is Outcome.UNSUPPORTED and "the toy knows discs" in found.reason
    assert asked == [Outcome.UNSUPPORTED]
    unknown = replace(release("1.1.0"), unknown="1.1.0 is not known")
    assert drive(store, unknown, [SLOT], ONE)[0].outcome is Outcome.UNSUPPORTED
    assert answered(store, unknown, [SLOT]) == {}  # no code of ours has spoken: nothing of it counts


def test_profile_with_a_failed_receipt_without_verdicts(toy, store):
    asks_none = replace(SLOT, params=(("e", 0.0), ("v", 4.0)))
    found = ask(store, "2.0.0", (SLOT, asks_none))
    assert {o.slot: o.outcome for o in found} == {SLOT: Outcome.OK, asks_none: Outcome.OK}
    told = history.told_by("toy", "2.0.0", found)
    assert told.doubted == ("default: receipt restitution fails in impact",)
    assert told.rows and {(row.outcome, row.physics) for row in told.rows} == {("invalid", None)}
    healthy = history.told_by("toy", "1.0.0", ask(store, "1.0.0", (SLOT, asks_none)))
    assert {row.physics for row in healthy.rows} - {None} == {"pass"} and not healthy.doubted


def test_a_scene_file_runs_where_nothing_can_read_it(toy, store, tmp_path):
    path = tmp_path / "drop.toml"
    path.write_text(
        'name = "drop"\ndimension = 2\ngravity = [0.0, -10.0]\nduration = 0.5\n'
        '[[bodies]]\nname = "floor"\nshape = { type = "half_space", angle = 0.0 }\nmotion = "fixed"\n'
        '[[bodies]]\nname = "disc"\nshape = { type = "disc", radius = 0.5 }\nmass = 2.0\npose = [0.0, 3.0, 0.0]\n'
        '[[checks]]\nquantity = "disc.vy"\nvalue = -5.0\ntolerance = 1e-6\n'
    )
    slot = Slot(pinned(str(path)), (), 2, "toy", "default", 1 / 240)
    (observation,) = ask(store, "1.0.0", (slot,))
    assert observation.outcome is Outcome.OK, observation.reason
    assert "pydantic" not in environments.existing(release("1.0.0")).receipt["packages"]
    verdicts = {row.metric: row.physics for row in rows_of("", [observation])}
    assert verdicts["final[disc.vy]"] == "pass"


def test_an_unknown_release_is_unsupported_with_the_range(store, monkeypatch):
    monkeypatch.setattr("validation.releases.driving.build", lambda *args: pytest.fail("it must not be installed"))
    old = chosen("mujoco", "2.3.0")[0]
    slot = replace(SLOT, engine="mujoco")
    (observation,) = drive(store, old, [slot], ONE)
    assert observation.outcome is Outcome.UNSUPPORTED and ">=3.0.0,<5" in observation.reason


def test_try_asks_an_unknown_release(toy, store):
    unknown = replace(release("1.0.0"), unknown="its adapter knows others")
    assert drive(store, unknown, [SLOT], ONE)[0].outcome is Outcome.UNSUPPORTED
    assert drive(store, unknown, [SLOT], replace(ONE, anyway=True))[0].outcome is Outcome.OK


def test_an_environment_that_holds_another_release_is_not_asked(toy, store, monkeypatch):
    other = environments.build(release("1.2.0"))
    monkeypatch.setattr("validation.releases.driving.build", lambda *args: other)
    (observation,) = ask(store, "1.0.0")
    assert observation.outcome is Outcome.NOT_INSTALLED
    assert "holds toyphysics 1.2.0" in observation.reason


ASKER = """
import sys
from pathlib import Path
from validation.cells import Slot
from validation.releases.choosing import chosen
from validation.releases.driving import Effort, drive
from validation.records.store import Store

slots = [Slot("impact", (("e", 0.5), ("v", 1.0 + k)), 2, "toy", "default", 1 / 240) for k in range(2)]
drive(Store(Path(sys.argv[1])), chosen("toy", "1.0.0")[0], slots, Effort(jobs=1))
"""


def driven(place):
    """Processes that run in an environment."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            command = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if str(place) in command and state != "Z":
            found.append(int(pid))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_processes_in_an_environment_ended_with_a_killed_run(toy, copied, tmp_path):
    place = copied(release("1.0.0")).path
    own = os.environ | {"TOY_SLEEP": "60"}
    command = [sys.executable, "-c", ASKER, str(tmp_path / "out")]
    process = subprocess.Popen(command, env=own, stderr=subprocess.PIPE)
    ends = time.monotonic() + 60.0
    while not driven(place) and time.monotonic() < ends:
        time.sleep(0.05)
    assert driven(place), process.communicate()[1]
    process.send_signal(signal.SIGKILL)
    process.communicate()
    # Its first step takes a minute: it must end because its parent has, not because it is done.
    ends = time.monotonic() + 45.0
    while driven(place) and time.monotonic() < ends:
        time.sleep(0.1)
    left = driven(place)
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert not left


#: One old release per engine of ours that has a wheel for every Python this project runs on.
OLD = {"mujoco": "3.2.7", "chipmunk": "6.11.1", "bullet": "3.2.6"}


@pytest.mark.long
@pytest.mark.parametrize("engine", OLD)
def test_a_real_old_release_is_installed_and_answers(engine, store, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    if engine == "bullet" and sys.version_info >= (3, 12):
        pytest.skip("PyBullet has no wheel beyond CPython 3.11")
    offered.cache_clear()
    try:
        listed = [each.version for each in offered(engine)]
    except RegistryError as error:
        pytest.skip(f"no old environment is built: {error}")
    assert OLD[engine] in listed
    old = chosen(engine, OLD[engine])[0]
    found = drive(store, old, [replace(SLOT, engine=engine, profile="tuned")], ONE)
    assert [(o.outcome, o.engine_version) for o in found] == [(Outcome.OK, OLD[engine])], found[0].reason
    assert all(slip["holds"] for slip in found[0].receipts)
    assert found[0].metrics["rebound_ratio"][0] == pytest.approx(0.5, abs=1e-6)
