"""What has been computed is handed out, whatever happens to the cells that come after it; workers here are scripted."""

import json
from dataclasses import replace
from typing import ClassVar

import pytest

from adapters.isolation import Lost
from adapters.isolation.foreign import Found
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.running import warming
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
        self.job = json.loads(message)
        if "slot" in self.job:
            self.asked.append(self.job["slot"])

    def has_answer(self):
        return True

    def ended(self):
        return False

    def receive(self, timeout):
        if "compile" in self.job:
            raise Lost("no part is compiled here")
        slot = slot_from_dict(self.asked[-1])
        told = self.told.get(slot)
        if told == "ends" and len(self.asked) > 1:
            raise Lost("the process was killed by SIGSEGV")
        answer = {"changed": "", "unwritten": None, "stages": [], "outcome": Outcome.OK} | (
            told if isinstance(told, dict) else {}
        )
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

        _run.begun, _run.reasons = 0, {}

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
                _run.reasons[observation.slot] = observation.reason
        except (limits.LimitError, OSError, ZeroDivisionError) as error:
            raised = error
        return found, raised

    return _run


def test_finished_answer_kept_when_the_next_worker_fails(run, monkeypatch):
    """Its engine has nothing left that is worth asking, so the next cell is another engine's."""
    monkeypatch.setattr(pool, "MOST_TIMEOUTS", 1)
    late, left, other = cell("chipmunk", 1.0), cell("chipmunk", 2.0), cell("mujoco", 1.0)
    reasons = []
    told = {late: {"outcome": Outcome.TIMED_OUT}}
    found, raised = run([late, left, other], told, 1, leave=lambda slot, reason: reasons.append(slot))
    assert found == [late] and reasons == [left] and isinstance(raised, limits.LimitError)


def test_other_worker_s_answer_kept_when_a_restart_fails(run):
    """One of two workers is spoilt and cannot be renewed: the other's answer comes first, then the reason."""
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0, 5.0)]
    found, raised = run(slots, {slots[0]: {"changed": "folder"}}, 2, jobs=2)
    assert found == slots[:3] and isinstance(raised, limits.LimitError)


def test_unwritable_trajectory_costs_no_other_answer(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0)]
    found, raised = run(slots, {slots[0]: {"unwritten": [28, "No space left on device", "a.npz"]}}, 2, jobs=2)
    assert found == [slots[1]] and isinstance(raised, Unwritten) and raised.filename == "a.npz"


def test_unwritable_recording_costs_no_other_answer(run, monkeypatch):
    """The cell itself is as if it had not run: a run that is resumed asks it again."""
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0, 4.0)]
    monkeypatch.setattr(pool, "recording_from_bytes", lambda text: text)

    def full(slot, recording):
        raise OSError(28, "No space left on device")

    found, raised = run(slots, {slots[0]: {"recording": "AAAA"}}, 2, jobs=2, record=full)
    assert found and slots[0] not in found and set(found) < set(slots) and raised.errno == 28


def test_finished_answer_kept_when_the_caller_is_full(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0)]
    found, raised = run(slots, {}, 1, keep=lambda slot: 1 / 0 if slot == slots[1] else None)
    assert found == slots[:1] and isinstance(raised, ZeroDivisionError)


def test_process_renewed_after_a_cell_changed_it(run):
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0)]
    assert run(slots, {}, 2) == (slots, None) and run.begun == 1
    assert run(slots, {slots[0]: {"changed": "open files"}}, 2) == (slots, None) and run.begun == 2
    assert run([*slots, cell("mujoco", 1.0)], {}, 2) == ([*slots, cell("mujoco", 1.0)], None)


def test_case_that_ends_a_reused_process(run):
    """They may have left the cause there: it runs once more, in a new process, and its observation tells both."""
    slots = [cell("chipmunk", v) for v in (1.0, 2.0, 3.0)]
    assert run(slots, {slots[2]: "ends"}, 2) == (slots, None)
    said = "in a process that had run others (2): the process was killed by SIGSEGV; alone it runs"
    assert [run.reasons[slot] for slot in slots] == ["", "", said]
    ends = {"outcome": Outcome.CRASHED, "changed": "what was raised"}
    assert run(slots, {slots[1]: ends}, 3) == (slots, None)
    assert [len(worker.asked) for worker in run.workers] == [2, 1, 1]
    assert run(slots, {slots[0]: ends}, 2) == (slots, None)
    assert [len(worker.asked) for worker in run.workers] == [1, 2], "the first process had run nothing else"


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_a_worker_is_asked_by_one_engine_alone(run, jobs):
    """What an engine does to its process can then reach no other's, whether or not it is noticed."""
    slots = [cell(engine, v) for v in (1.0, 2.0, 3.0) for engine in ("chipmunk", "mujoco", "bullet")]
    found, raised = run(slots, {}, 9, jobs=jobs)
    assert sorted(found, key=slots.index) == slots and raised is None
    asked = [{slot["engine"] for slot in worker.asked} for worker in run.workers if worker.asked]
    assert all(len(engines) == 1 for engines in asked) and len(asked) >= 3


def test_plugin_that_exits_on_import_reaches_no_worker(monkeypatch):
    reason = "the plugin ended its process: SIGABRT"
    for module in (pool.registry, warming):
        monkeypatch.setattr(module, "find", lambda name: Found(name, None, "6.6", reason, fatal=True))
    monkeypatch.setattr(pool, "_started", lambda memory: pytest.fail("a worker was started"))
    slots = [cell("ending", v) for v in (1.0, 2.0)]
    told = list(run_cells(slots))
    assert [answer.slot for answer in told] == slots
    assert {(answer.outcome, answer.reason, answer.log) for answer in told} == {(Outcome.CRASHED, reason, "")}
    assert {answer.engine_version for answer in told} == {"6.6"}


class Compiler(Worker):
    """Writes what it is asked into `log`; compiles for so many rounds of the pool, while others answer at once."""

    log: ClassVar[list] = []
    fails = None
    rounds = 5

    def send(self, message):
        super().send(message)
        slots = self.job.get("compile")
        self.left = self.rounds if slots else 0
        told = [slot_from_dict(data) for data in slots or [self.job["slot"]]]
        self.log.append(("compile" if slots else "cell", told))

    def has_answer(self):
        self.left -= 1
        return self.left < 0

    def receive(self, timeout):
        if "compile" not in self.job:
            return super().receive(timeout)
        if self.job["compile"][0]["profile"] == self.fails or self.left >= 0:
            raise Lost("the process was killed by SIGKILL")
        return b'{"compiled": true, "stages": []}'


@pytest.fixture
def compiled(run, monkeypatch, tmp_path):
    """`compiled(slots, jobs, fails)`: what workers were asked, in order, with kernels for ``mujoco`` alone."""
    monkeypatch.setattr(warming, "_folder", lambda name: tmp_path if name == "mujoco" else None)
    monkeypatch.setitem(globals(), "Worker", Compiler)
    monkeypatch.setattr(pool, "wait", lambda watched, left: [])

    def _compiled(slots, jobs, fails=None, **options):
        Compiler.log, Compiler.fails = [], fails
        found, raised = run(slots, {}, 20, jobs=jobs, **options)
        assert raised is None and sorted(found, key=slots.index) == slots
        return Compiler.log

    return _compiled


#: Eight cells, four of which need kernels, of two profiles.
MIXED = [Slot("impact", (("v", v),), 2, engine, profile, DT)
         for v in (1.0, 2.0) for engine in ("mujoco", "chipmunk") for profile in ("first", "then")]  # fmt: skip


def needs_kernels(slot):
    return slot.engine == "mujoco"


@pytest.mark.parametrize("jobs", [1, 2, 3, 8])
def test_no_cell_starts_before_its_kernels_are_compiled(compiled, jobs):
    done = []
    log = compiled(MIXED, jobs, compiled=lambda part: done.append((part.key, len(Compiler.log))))
    for slot in filter(needs_kernels, MIXED):
        assert log.index(("cell", [slot])) >= dict(done)[warming.key_of(slot)]
    assert [key[1] for key, _ in done] == ["first", "then"]
    assert [slots[0].profile for kind, slots in log if kind == "compile"] == ["first", "then"]


def test_kernel_compilation_beside_cells_without_kernels(compiled):
    log = compiled(MIXED, 2)
    assert log[0][0] == "compile" and not any(needs_kernels(slots[0]) for _, slots in log[1:5])
    at = log.index(("compile", [MIXED[1]]))
    assert at > 4  # then the second profile's kernels, while cells of the first run
    assert ("cell", [MIXED[0]]) in log[at:]


def test_renewal_of_a_worker_that_compiles(compiled, run):
    """Parts share code in one process, which leaves much memory in use."""
    log = compiled(list(filter(needs_kernels, MIXED)), 1)
    assert [kind for kind, _ in log] == ["compile", "cell", "cell", "compile", "cell", "cell"] and run.begun == 2


def test_one_worker_runs_cells_without_kernels_first(compiled):
    log = compiled(MIXED, 1)
    assert [kind for kind, _ in log] == ["cell"] * 4 + ["compile"] + ["cell"] * 2 + ["compile"] + ["cell"] * 2
    assert not any(needs_kernels(slots[0]) for _, slots in log[:4])


def test_all_workers_compile_where_all_cells_need_kernels(compiled):
    log = compiled(list(filter(needs_kernels, MIXED)), 2)
    assert [kind for kind, _ in log[:2]] == ["compile"] * 2


def two_parts_each():
    return [replace(slot, dimension=dim) for slot in MIXED[:2] for dim in (3, 2)]


def test_parts_of_one_profile_beside_cells_that_can_run(compiled):
    """They share kernels, which two processes side by side would both compile; another profile's part goes first."""
    slots, done = [*two_parts_each(), *(slot for slot in MIXED if not needs_kernels(slot))], {}
    log = compiled(slots, 4, compiled=lambda part: done.setdefault(part.key[1:], len(Compiler.log)))
    assert log[:2] == [("compile", [slots[0]]), ("compile", [slots[2]])]
    assert log[2][0] == "cell"


@pytest.mark.parametrize("jobs", [2, 4])
def test_parts_of_one_profile_without_other_work(compiled, jobs):
    """No seat is idle while parts are left; those of another profile are the first to go."""
    slots = two_parts_each()
    log = compiled(slots, jobs)
    assert log[:jobs] == [("compile", [slots[k]]) for k in (0, 2, 1, 3)[:jobs]]


def test_compilation_once_and_retry_after_failure(compiled):
    """Cells whose kernels could not be compiled run all the same: they report why."""
    log = compiled(MIXED, 2, fails="first")
    assert [slots[0].profile for kind, slots in log if kind == "compile"] == ["first", "then"]
    log = compiled(MIXED, 2)
    assert [slots[0].profile for kind, slots in log if kind == "compile"] == ["first"]
    assert all(kind == "cell" for kind, _ in compiled(MIXED, 2))


def test_an_interrupted_compilation_is_resumed(compiled, monkeypatch):
    """What was compiled stays so; the rest is compiled by the next run."""
    monkeypatch.setattr(Compiler, "rounds", 12)  # longer than the cells that can run meanwhile

    def wait(watched, left):
        if Compiler.log[-1][0] == "compile" and Compiler.log[-1][1][0].profile == "then":
            raise KeyboardInterrupt
        return []

    monkeypatch.setattr(pool, "wait", wait)
    with pytest.raises(KeyboardInterrupt):
        compiled(MIXED, 1)
    assert [part.key[1] for part in warming.missing(MIXED)] == ["then"]
    monkeypatch.setattr(pool, "wait", lambda watched, left: [])
    assert [slots[0].profile for kind, slots in compiled(MIXED, 1) if kind == "compile"] == ["then"]


def test_kernels_are_compiled_without_cells(compiled):
    assert compiled([], 2, parts=warming.missing(MIXED)) == [("compile", [slot]) for slot in MIXED[:2]]
    assert compiled([], 2, parts=[]) == []


def test_time_limits_of_cells_do_not_include_compilation(compiled, monkeypatch):
    """The clock advances a second at each look at it: a compilation takes more than the limit of a cell."""
    clock = iter(range(10**6))
    monkeypatch.setattr(pool.time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(Compiler, "rounds", 200)
    late = []
    log = compiled(MIXED, 1, timeout=100.0, leave=lambda slot, reason: late.append(slot))
    assert len(log) == 10 and late == [] and warming.missing(MIXED) == []


def test_cells_after_a_hanging_compilation(compiled, monkeypatch):
    clock = iter(range(10**6))
    monkeypatch.setattr(pool.time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(Compiler, "rounds", 10**6)
    monkeypatch.setattr(pool, "COMPILING", 50.0)
    assert len(compiled(MIXED, 2)) == 10 and len(warming.missing(MIXED)) == 2
