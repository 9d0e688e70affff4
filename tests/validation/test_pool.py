"""What has been computed is handed out, whatever happens to the cells that come after it; workers here are scripted."""

import json

import pytest

from adapters.foreign import Found
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.workers import limits, pool, run_cells
from validation.workers.pool import Unwritten

DT = 1 / 240


def cell(engine, v, scene="impact"):
    return Slot(scene, (("v", v),), 2, engine, "tuned", DT)


class Worker:
    """Answers at once, as ``told`` says of a slot: its outcome, what it changed, what it could not write."""

    sentinels = ()

    def __init__(self, told):
        self.told, self.written, self.asked = told, b"", []

    def send(self, message):
        self.asked.append(json.loads(message)["slot"])

    def has_answer(self):
        return True

    def ended(self):
        return False

    def receive(self, timeout):
        slot = slot_from_dict(self.asked[-1])
        answer = {"changed": "", "unwritten": None, "outcome": Outcome.OK} | self.told.get(slot, {})
        observation = Observation(slot, "", 1, "1", answer.pop("outcome")).as_dict()
        return json.dumps({"observation": observation, "recording": None} | answer).encode()

    def tail(self):
        return ""

    def stop(self):
        return ""


@pytest.fixture
def run(monkeypatch):
    """Run slots on so many workers; no more of them start. What came back, and what was raised."""

    def _run(slots, told, workers, jobs=1, **options):
        _run.workers = [Worker(told) for _ in range(workers)]
        left = iter(_run.workers)

        _run.begun = 0

        def started(memory):
            worker = next(left, None)
            _run.begun += worker is not None
            if worker is None:
                raise limits.LimitError("worker: cannot start: no memory")
            return worker

        monkeypatch.setattr(pool, "_started", started)
        monkeypatch.setattr(limits, "workers", lambda jobs, cells: jobs)
        found, raised = [], None
        try:
            for observation in run_cells(slots, jobs, **options):
                found.append(observation.slot)
        except (limits.LimitError, OSError, ZeroDivisionError) as error:
            raised = error
        return found, raised

    return _run


def test_an_answer_in_hand_is_not_lost_where_the_next_worker_cannot_start(run, monkeypatch):
    """Its engine has nothing left that is worth asking, so the next cell is another engine's."""
    monkeypatch.setattr(pool, "MOST_TIMEOUTS", 1)
    late, left, other = cell("chipmunk", 1.0), cell("chipmunk", 2.0), cell("mujoco", 1.0)
    reasons = []
    told = {late: {"outcome": Outcome.TIMED_OUT}}
    found, raised = run([late, left, other], told, 1, leave=lambda slot, reason: reasons.append(slot))
    assert found == [late] and reasons == [left] and isinstance(raised, limits.LimitError)


def test_what_another_worker_has_computed_is_not_lost_where_one_cannot_start_again(run):
    """One of two workers is spoilt and cannot be renewed: the other's answer comes first, then the reason."""
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0, 5.0)]
    found, raised = run(slots, {slots[0]: {"changed": "folder"}}, 2, jobs=2)
    assert found == slots[:3] and isinstance(raised, limits.LimitError)


def test_a_trajectory_that_cannot_be_written_costs_no_other_answer(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0)]
    found, raised = run(slots, {slots[0]: {"unwritten": [28, "No space left on device", "a.npz"]}}, 2, jobs=2)
    assert found == [slots[1]] and isinstance(raised, Unwritten) and raised.filename == "a.npz"


def test_a_recording_that_cannot_be_kept_costs_no_other_answer(run, monkeypatch):
    """The cell itself is as if it had not run: a run that is resumed asks it again."""
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0)]
    monkeypatch.setattr(pool, "recording_from_bytes", lambda text: text)

    def full(slot, recording):
        raise OSError(28, "No space left on device")

    found, raised = run(slots, {slots[0]: {"recording": "AAAA"}}, 2, jobs=2, record=full)
    assert found and slots[0] not in found and set(found) < set(slots) and raised.errno == 28


def test_an_answer_in_hand_is_not_lost_where_the_caller_has_no_place_for_the_next(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0)]
    found, raised = run(slots, {}, 1, keep=lambda slot: 1 / 0 if slot == slots[1] else None)
    assert found == slots[:1] and isinstance(raised, ZeroDivisionError)


def test_a_process_that_a_cell_changed_is_renewed_and_its_answer_stands(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0)]
    assert run(slots, {}, 2) == (slots, None) and run.begun == 1
    assert run(slots, {slots[0]: {"changed": "open files"}}, 2) == (slots, None) and run.begun == 2
    assert run([*slots, cell("mujoco", 1.0)], {}, 2) == ([*slots, cell("mujoco", 1.0)], None)


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_a_worker_is_asked_by_one_engine_alone(run, jobs):
    """What an engine does to its process can then reach no other's, whether or not it is noticed."""
    slots = [cell(engine, v) for v in (1.0, 2.0, 3.0) for engine in ("chipmunk", "mujoco", "bullet")]
    found, raised = run(slots, {}, 9, jobs=jobs)
    assert sorted(found, key=slots.index) == slots and raised is None
    asked = [{slot["engine"] for slot in worker.asked} for worker in run.workers if worker.asked]
    assert all(len(engines) == 1 for engines in asked) and len(asked) >= 3


def test_cells_of_a_plugin_that_ends_its_importer_reach_no_worker(monkeypatch):
    reason = "the plugin ended its process: SIGABRT"
    monkeypatch.setattr(pool.registry, "find", lambda name: Found(name, None, "6.6", reason, fatal=True))
    monkeypatch.setattr(pool, "_started", lambda memory: pytest.fail("a worker was started"))
    slots = [cell("ending", v) for v in (1.0, 2.0)]
    told = list(run_cells(slots))
    assert [answer.slot for answer in told] == slots
    assert {(answer.outcome, answer.reason, answer.log) for answer in told} == {(Outcome.CRASHED, reason, "")}
    assert {answer.engine_version for answer in told} == {"6.6"}
