"""Who hands batches to a cluster and collects what comes back, on one where nothing runs; and a batch's far side."""

import io
import json
import sys
from contextlib import ExitStack
from dataclasses import replace
from types import SimpleNamespace

import pytest

from adapters.scene import SceneError
from validation.cells import Observation, Outcome, Slot, prepare
from validation.workers import LimitError, batch, cluster
from validation.workers.cluster import LEAST, MOST, MOST_LOST, _batches, _client, _Driver, checked, run_cells_on

pytest.importorskip("distributed", reason="pip install -e '.[dask]'")
pytest.importorskip("pymunk")


def test_engine_and_size_of_batches():
    slots = [Slot("impact", (("v", float(k + 1)),), 2, e, "p", 0.1) for k in range(2000) for e in ("a", "b")]
    batches = list(_batches(slots, 2))
    assert sorted((s for batch in batches for s in batch), key=Slot.key) == sorted(slots, key=Slot.key)
    assert all(len({slot.engine for slot in batch}) == 1 and len(batch) <= MOST for batch in batches)
    assert [batch[0].engine for batch in batches[:4]] == ["a", "b", "a", "b"]
    assert len(next(_batches(slots[:LEAST], 64))) >= LEAST // 2


@pytest.mark.parametrize("address", ["", "local:0", "local:x", "http://a:1", "tcp://a", "tcp://a:b", "tcp://a b:1"])
def test_impossible_address_refused(address):
    with pytest.raises(SceneError, match="neither local:N nor tcp"):
        checked(address)


class Future:
    """What a cluster says of a batch: finished with a result, or lost with an error."""

    def __init__(self, result=None, error=None, status="finished"):
        self.status = "error" if error else status
        self._result, self._error = result, error

    def result(self):
        return self._result

    def exception(self):
        return self._error

    def add_done_callback(self, callback):
        pass

    def release(self):
        pass


class Client:
    """A cluster on which nothing runs: it remembers what was handed to it."""

    def __init__(self):
        self.status, self.handed = "running", []

    def submit(self, function, text, timeout, topic, name, **options):
        assert options["retries"] == 0 and options["pure"] is False
        self.handed.append([json.loads(line) for line in text.splitlines()[1:]])
        return Future()


@pytest.fixture
def driver():
    left = {}
    made = _Driver(Client(), io.StringIO(), 9.0, lambda slot, reason: left.__setitem__(slot, reason))
    made.left = left
    return made


def cells(count):
    return [Slot("impact", (("v", float(k + 1)),), 2, "chipmunk", "tuned", 1 / 240) for k in range(count)]


def answer(slot, **changed):
    found = Observation(slot, prepare(slot).cell.key(), 1, "7.3.1", Outcome.OK)
    return json.dumps(replace(found, **changed).as_dict())


def batch_of(driver, slots):
    driver._submit(list(slots))
    return f"{driver.topic}-{driver.made}"


def test_a_cell_that_comes_back_twice_counts_once(driver):
    (slot,) = cells(1)
    name = batch_of(driver, [slot])
    line = answer(slot)
    assert len(list(driver._heard({"batch": name, "line": line, "worker": "w"}))) == 1
    driver.futures[name] = Future({"lines": [line], "left": "", "said": "", "worker": "w"})
    assert list(driver._ended(name)) == [] and not driver.batches


def test_lost_batch_asked_again_in_halves(driver):
    slots = cells(5)
    name = batch_of(driver, slots)
    driver._line(driver.batches[name], answer(slots[0]), "w").__next__()
    driver.futures[name] = Future(error=RuntimeError("its worker died"))
    assert list(driver._ended(name)) == []
    again = driver.client.handed[1:]
    assert [len(part) for part in again] == [2, 2]
    assert [each["params"]["v"] for part in again for each in part] == [2.0, 3.0, 4.0, 5.0]
    note = [json.loads(line) for line in driver.journal.getvalue().splitlines()][-1]
    assert note["event"] == "lost" and len(note["cells"]) == 4 and "its worker died" in note["reason"]


def test_cell_that_kills_its_worker_repeatedly_as_one_crash(driver):
    name = batch_of(driver, cells(1))
    for _ in range(MOST_LOST - 1):
        driver.futures[name] = Future(error=RuntimeError("gone"))
        assert list(driver._ended(name)) == []
        name = f"{driver.topic}-{driver.made}"
    driver.futures[name] = Future(error=RuntimeError("gone"))
    (found,) = driver._ended(name)
    assert found.outcome is Outcome.CRASHED and "lost with its worker 3 times" in found.reason
    assert not driver.batches


def test_cells_left_by_a_batch_not_asked_again(driver):
    slots = cells(2)
    name = batch_of(driver, slots)
    driver.futures[name] = Future({"lines": [], "left": "left: it timed out 3 times", "said": "", "worker": "w"})
    assert list(driver._ended(name)) == [] and len(driver.client.handed) == 1
    assert driver.left == dict.fromkeys(slots, "left: it timed out 3 times")


def test_a_worker_with_other_code_is_refused(driver):
    (slot,) = cells(1)
    name = batch_of(driver, [slot])
    with pytest.raises(LimitError, match="has other code than this machine"):
        list(driver._heard({"batch": name, "line": answer(slot, cell="0" * 16, engine_version="7.0"), "worker": "w"}))


def test_journal_of_a_batch_begun_twice(driver):
    name = batch_of(driver, cells(2))
    for worker in ("a", "b"):
        list(driver._heard({"batch": name, "begun": worker}))
    notes = [json.loads(line) for line in driver.journal.getvalue().splitlines()]
    assert [(note["event"], note["worker"], len(note["cells"])) for note in notes] == [
        ("begun", "a", 2),
        ("again", "b", 2),
    ]


@pytest.mark.parametrize("line", ["", "{", '{"slot": 1}', "[]", '{"line": 1, "error": "left"}'])
def test_partial_line_of_a_dead_process(driver, line):
    name = batch_of(driver, cells(1))
    assert list(driver._line(driver.batches[name], line, "w")) == [] and len(driver.batches[name].slots) == 1


# ---- a whole run ----


class Busy(Client):
    """A cluster with two workers, of which each batch is back as soon as it is handed over, or as ``ends`` says."""

    def __init__(self, ends=()):
        super().__init__()
        self.ends, self.topics, self.keys = list(ends), [], []

    def wait_for_workers(self, count, timeout):
        assert (count, timeout) == (1, cluster.PATIENCE)

    def nthreads(self):
        return {"w": 1, "x": 1}

    def subscribe_topic(self, topic, handler):
        self.topics.append(("on", topic))
        self.tell = handler

    def unsubscribe_topic(self, topic):
        self.topics.append(("off", topic))

    def submit(self, function, text, timeout, topic, name, **options):
        assert function is cluster.run_batch and timeout == 9.0 and ("on", topic) in self.topics
        assert options["key"] == name
        self.keys.append(name)
        super().submit(function, text, timeout, topic, name, **options)
        assert json.loads(text.splitlines()[0]) == {"scenes": {}}
        slots = [
            Slot(**{**each, "params": tuple(each["params"].items())}) for each in map(json.loads, text.splitlines()[1:])
        ]
        future = self.ends.pop(0)(slots) if self.ends else Future(
            {"lines": [answer(slot) for slot in slots], "left": "", "said": "", "worker": "w"}
        )  # fmt: skip
        future.add_done_callback = lambda callback: callback(future)
        self.tell((0, {"batch": name, "begun": "w"}))
        return future


def driven(client, slots):
    left = {}
    made = _Driver(client, io.StringIO(), 9.0, lambda slot, reason: left.__setitem__(slot, reason))
    found = list(made.run(slots))
    return found, left, [json.loads(line) for line in made.journal.getvalue().splitlines()], made


def test_slots_returned_once_and_batches_in_the_journal():
    slots, client = cells(60), Busy()
    found, left, notes, made = driven(client, slots)
    assert sorted(each.slot.params for each in found) == sorted(slot.params for slot in slots) and not left
    # Two workers of four batches each would have 8 cells: the fewest are 25.
    assert [len(part) for part in client.handed] == [25, 25, 10]
    assert client.keys == [f"{made.topic}-{k}" for k in (1, 2, 3)]
    assert client.topics == [("on", made.topic), ("off", made.topic)] and made.topic.startswith("crosscheck-")
    told = [(note["event"], note["batch"], len(note["cells"])) for note in notes]
    sizes = tuple(zip(client.keys, (25, 25, 10), strict=True))
    assert told == [line for name, n in sizes for line in (("begun", name, n), ("ended", name, 0))]
    assert notes[0]["worker"] == "w" and notes[0]["cells"] == [slot.key() for slot in slots[:25]]
    assert all(abs(note["time"] - notes[0]["time"]) < 60.0 for note in notes)


def test_repeatedly_lost_cell_as_a_crash():
    dead = Future({"lines": [], "left": "", "said": "run-cell ended with -9: killed", "worker": "w"})
    client = Busy([lambda slots: dead] * (1 + MOST_LOST))
    (found,), left, notes, _ = driven(client, cells(1))
    assert (found.outcome, found.slot) == (Outcome.CRASHED, cells(1)[0]) and not left
    assert found.reason == "lost with its worker 3 times: run-cell ended with -9: killed"
    assert (found.cell, found.scene_version, found.engine_version) == ("", 0, "")
    assert [note["event"] for note in notes].count("lost") == MOST_LOST == len(client.handed)
    assert {note["reason"] for note in notes if note["event"] == "lost"} == {"run-cell ended with -9: killed"}
    client = Busy([lambda slots: Future(error=KeyError("no such worker"))])
    (found,), _, notes, _ = driven(client, cells(1))
    assert found.outcome is Outcome.OK and [n["reason"] for n in notes if n["event"] == "lost"] == [
        "KeyError: 'no such worker'"
    ]


def test_leftovers_of_a_batch_with_reason_in_the_journal():
    def leaving(slots):
        return Future({"lines": [answer(slots[0])], "left": "left: it hung\nthree times", "said": "", "worker": "w"})

    found, left, notes, _ = driven(Busy([leaving]), cells(3))
    assert [each.slot for each in found] == cells(1) and left == dict.fromkeys(cells(3)[1:], "left: it hung")
    assert (notes[-1]["event"], notes[-1]["reason"], len(notes[-1]["cells"])) == ("left", "left: it hung", 2)


def test_lost_scheduler_ends_the_run_in_one_line(monkeypatch):
    gone = "cluster: the scheduler is gone; finished cases are kept, the same command resumes"
    with pytest.raises(LimitError) as ended:
        driven(Busy([lambda slots: Future(status="cancelled")]), cells(1))
    assert str(ended.value) == gone

    class Silent(Busy):
        def submit(self, *given, **options):
            Client.submit(self, *given, **options)
            return SimpleNamespace(add_done_callback=lambda callback: None)

    client = Silent()
    client.status = "closed"
    with pytest.raises(LimitError) as ended:
        driven(client, cells(1))
    assert str(ended.value) == gone
    client = Silent()
    client.status = "connecting"  # it may come back, but not for ever
    monkeypatch.setattr(cluster, "SILENCE", 0.0)
    with pytest.raises(LimitError) as ended:
        driven(client, cells(1))
    assert str(ended.value) == gone


def test_a_cluster_without_a_worker_is_one_line(monkeypatch):
    class Empty(Busy):
        def wait_for_workers(self, count, timeout):
            raise TimeoutError

    with pytest.raises(LimitError, match=r"^cluster: no worker came within 60 s$"):
        driven(Empty(), cells(1))


def test_other_code_on_a_worker_told_with_both_versions(driver, monkeypatch):
    slots = cells(3)
    name = batch_of(driver, slots)
    wrong = answer(slots[0], cell="0" * 16, engine_version="7.0")
    with pytest.raises(LimitError) as refused:
        list(driver._heard({"batch": name, "line": wrong, "worker": "tcp://w:1"}))
    here = prepare(slots[0]).cell.engine_version
    said = f"chipmunk 7.0 there, {here} here"
    assert (
        str(refused.value) == f"cluster: tcp://w:1 has other code than this machine ({said}); its results would differ"
    )
    asked = []
    monkeypatch.setattr(cluster, "prepare", lambda slot: asked.append(slot) or prepare(slot))
    for slot, worker in zip(slots, ("w", "w", "x"), strict=True):
        assert len(list(driver._heard({"batch": name, "line": answer(slot), "worker": worker}))) == 1
    assert asked == [slots[0], slots[2]]  # the first of each worker
    assert list(driver._heard({"batch": "of another run", "line": answer(slots[0])})) == []


def test_cluster_size_as_requested_and_none_without_slots(monkeypatch, tmp_path):
    import distributed

    def asked(*given, **options):
        raise OSError("nobody\nlistens")

    monkeypatch.setattr(distributed, "Client", asked)
    assert list(run_cells_on("tcp://a:1", [], 9.0, tmp_path / "journal")) == []
    with ExitStack() as stack, pytest.raises(LimitError) as refused:
        _client("tcp://a:1", stack)
    assert str(refused.value) == "cluster: tcp://a:1 does not answer: nobody"
    made = []
    monkeypatch.setattr(distributed, "LocalCluster", lambda **options: made.append(options) or ExitStack())
    monkeypatch.setattr(distributed, "Client", lambda *given, **options: (given, options))
    with ExitStack() as stack:
        (inside,), options = _client("local:3", stack)
        assert isinstance(inside, ExitStack) and options == {"set_as_default": False}
        assert made == [{"n_workers": 3, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}]
        given, options = _client("tls://a:2", stack)
        assert given == ("tls://a:2",) and options == {"timeout": cluster.SILENCE, "set_as_default": False}


# ---- the far side ----


class Process:
    """``run-cell`` as a batch sees it: what it is told, what it answers, and how it ends."""

    made: list

    def __init__(self, command, stdin, stdout, stderr, text):
        self.command, self.told, self.killed = command, io.StringIO(), 0
        self.stdin = SimpleNamespace(write=self.told.write, close=lambda: setattr(self, "closed", True))
        self.stdout = iter(Process.answers)
        stderr.write(Process.errors)
        assert text is True and stdin == stdout == batch.subprocess.PIPE
        Process.made.append(self)

    def wait(self):
        return Process.code

    def kill(self):
        self.killed += 1


@pytest.mark.parametrize(
    ("code", "answers", "left"),
    [
        (0, ['{"slot": 1}\n', '{"slot": 2}\n'], ""),
        (2, ['{"error": "scenes: no table"}\n'], "scenes: no table"),
        (4, ['{"slot": 1}\n', '{"error": "left: it hung"}\n', '{"error": "left: it hung again"}\n'], "left: it hung"),
        (4, ['{"slot": 1}\n'], ""),
        (-9, ['{"slot": 1}\n', '{"err'], ""),
    ],
)
def test_answers_and_process_of_a_batch(monkeypatch, code, answers, left):
    import distributed

    heard = []
    worker = SimpleNamespace(address="tcp://w:1", log_event=lambda topic, event: heard.append((topic, event)))
    monkeypatch.setattr(distributed, "get_worker", lambda: worker)
    Process.made, Process.code, Process.answers = [], code, answers
    Process.errors = "first\nsecond\nthird\n"
    monkeypatch.setattr(batch.subprocess, "Popen", Process)
    found = batch.run_batch("a line\nanother", 2.5, "topic", "topic-1")
    assert found == {
        "lines": answers, "left": left, "said": f"run-cell ended with {code}: second\nthird", "worker": "tcp://w:1",
    }  # fmt: skip
    (process,) = Process.made
    module = [sys.executable, "-P", "-m", "contact_crosscheck"]
    assert process.command == [*module, "run-cell", "--batch", "--timeout", "2.5"]
    assert process.told.getvalue() == "a line\nanother\n" and process.closed and process.killed == 1
    assert heard == [
        ("topic", {"batch": "topic-1", "begun": "tcp://w:1"}),
        *[("topic", {"batch": "topic-1", "line": line, "worker": "tcp://w:1"}) for line in answers],
    ]
