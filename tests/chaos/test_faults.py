"""Every fault of an engine costs its own cell: an innocent engine in the same batch keeps every bit."""

import json
import os
import sys
import xml.etree.ElementTree as ElementTree
from io import StringIO
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters import registry
from adapters.plain import REASON
from reports import exports
from reports.command import main
from reports.progress import run_plan
from validation.cells import Outcome, Slot, observation_from_dict
from validation.judging.rows import rows_of
from validation.records.store import Store
from validation.running.execution import execute
from validation.workers import run_cells
from validation.workers.pool import MOST_TIMEOUTS

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the faults use what Linux offers")
DT = 1.0 / 240.0
#: Faults that end the process or raise, and what the row must say.
CRASHES = {
    "abort": "SIGABRT",
    "segfault": "SIGSEGV",
    "leave_at_once": "exit code 7",
    "leave": "SystemExit",
    "interrupt": "KeyboardInterrupt",
    "close_generator": "GeneratorExit",
    "raise_base": "Bad: not an Exception",
    "raise_mute": "Mute",
    "raise_steering": "RuntimeError",
    "raise_long": "RuntimeError: xxx",
    "signal_real_time": "signal 39",
    "signal_kill": "SIGKILL",
    "signal_trap": "SIGTRAP",
    "recurse": "RecursionError",
    "leak": "MemoryError",
    "print_much": "after a line of 100 MB",
    "print_binary": "after binary output",
    "close_files": "the process",
    "pose_shape": "pose: the engine gave an array of shape (1, 2), numbers of shape (1, 3) are needed",
    "pose_text": "pose: the engine gave a list, numbers",
    "twist_none": "twist: the engine gave None",
    "contacts_number": "contacts: the engine gave an int",
    "contacts_flat": "contacts.point: the engine gave an array of shape (3,)",
    "contacts_beyond": "contacts: the engine names bodies beyond the",
    "readback_list": "readback",
    "certificate_list": "certificate",
    "settings_none": "settings: None was given",
    "settings_words": "settings: a str was given",
    "settings_nan": "settings: odd is nan",
    "settings_raise": "RuntimeError: no",
    "settings_leave": "SystemExit",
    "refusal_number": "refuses: an int was given",
    "refusal_raise": "refused to say",
    "declares_none": "declares: None was given",
    "build_none": "build: the engine gave None",
    "answer_for_another": "answered what it was not asked",
    "half_answer": "half an answer",
    "clear_modules": "sys",
    "pose_uneven": "pose: the engine gave a list, numbers",
    "change_number": "initial_change: the engine gave an int",
}
#: Faults that change what cells share, or give odd values beside a sound motion: the cell itself is as it is.
ODD = {
    "round_up", "trap_floats", "ignore_numpy_errors", "close_streams", "close_stream_objects", "open_files",
    "limit_files", "limit_file_size", "change_environment", "change_folder", "change_mask", "handle_signals",
    "block_signals", "patch_math", "patch_numpy", "patch_loop", "patch_class", "patch_json", "patch_module",
    "stop_collecting", "lower_recursion", "clear_path", "leave_thread", "leave_child", "leave_session",
    "readback_cyclic", "readback_odd", "readback_large", "long_change", "settings_object",
    "pose_jumps", "fork", "shut_sockets", "change_later", "certificate_number",
}  # fmt: skip
DIVERGES = {"pose_nan"}
REFUSES = {"refusal_long"}


def innocent():
    """Eighteen cells of an engine that does nothing wrong."""
    speeds = [0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 6.0, 20.0, 50.0]
    return [Slot("impact", (("e", e), ("v", v)), 2, "chipmunk", "tuned", DT) for e in (0.5, 0.9) for v in speeds]


def faulty_slot(fault, **changes):
    return Slot("impact", tuple(changes.items()), 2, "faulty", fault, DT)


def test_the_table_has_every_switch(faulty):
    engine = registry.find("faulty").engine
    assert engine is not None, registry.find("faulty").reason
    assert set(engine.profiles) == {"none", "hang", *CRASHES, *ODD, *DIVERGES, *REFUSES}


def test_no_fault_reaches_another_cell(faulty, dice, every, tmp_path):
    """Faults and eighteen innocent cells in one batch, in random order; a healthy cell of the plugin after each."""
    expected = {slot: execute(slot).state_hash for slot in innocent()}
    healthy = execute(Slot("impact", (("v", 2.0),), 2, "chipmunk", "tuned", DT)).state_hash
    faults = sorted([*CRASHES, *ODD, *DIVERGES, *REFUSES])
    faults = dice.sample(faults, len(faults) if every else len(faults) // 3)
    pairs = [slot for fault in faults for slot in (faulty_slot(fault), faulty_slot("none", v=2.0))]
    found = list(run_cells([*expected, *pairs], jobs=2, timeout=300.0, memory=2 * 2**30))
    assert len(found) == len(expected) + len(pairs)

    hashes = {o.slot: o.state_hash for o in found if o.slot.engine == "chipmunk"}
    assert hashes == expected
    again = [o for o in found if o.slot.profile == "none"]
    assert {o.outcome for o in again} == {Outcome.OK}, [(o.outcome, o.reason) for o in again]
    assert {o.state_hash for o in again} == {healthy}

    by_fault = {o.slot.profile: o for o in found if o.slot.engine == "faulty"}
    expected_of = {fault: (Outcome.CRASHED,) for fault in CRASHES}
    expected_of |= dict.fromkeys(DIVERGES, (Outcome.DIVERGED,)) | dict.fromkeys(REFUSES, (Outcome.UNSUPPORTED,))
    expected_of |= dict.fromkeys(ODD, (Outcome.OK, Outcome.REFUSED, Outcome.INVALID, Outcome.CRASHED))
    other = {f: (by_fault[f].outcome, by_fault[f].reason) for f in by_fault.keys() & expected_of.keys()
             if by_fault[f].outcome not in expected_of[f] or CRASHES.get(f, "") not in by_fault[f].reason}  # fmt: skip
    assert other == {}

    for observation in found:
        assert observation.reason.isprintable() and len(observation.reason) <= REASON
        assert len(json.dumps(observation.as_dict(), allow_nan=False)) < 2**20, observation.slot.profile
        assert observation_from_dict(json.loads(json.dumps(observation.as_dict()))) == observation
    rows = [row.as_dict() for row in rows_of("r", found)]
    ElementTree.fromstring(exports.as_junit(rows))
    exports.as_json(rows), exports.as_csv(rows), exports.as_markdown(rows)
    assert not [line for line in processes() if "sleep 360" in line]


def test_answer_for_another_case_detected(faulty, tmp_path):
    """No row of another engine is written, every case has its own answer, and none is missing."""
    slots = [faulty_slot("answer_for_another"), *[faulty_slot("fork", v=float(v)) for v in range(1, 6)]]
    slots += [Slot("impact", (("v", v),), 2, "chipmunk", "tuned", DT) for v in (2.0, 3.0)]
    expected = execute(slots[-2])
    store, said = Store(tmp_path), StringIO()
    run = run_plan(store, "mistaken", slots, Console(file=said, width=200), jobs=1, timeout=60.0)
    found = {observation.slot: observation for observation in store.observations(run)}
    assert run.finished and list(found) == slots
    assert found[slots[0]].outcome is Outcome.CRASHED and "not asked" in found[slots[0]].reason
    assert all(found[slot].outcome is Outcome.OK for slot in slots[1:]), [found[slot].reason for slot in slots[1:]]
    assert len({found[slot].state_hash for slot in slots[1:6]}) == 5
    assert found[slots[-2]].metrics == expected.metrics and found[slots[-2]].state_hash == expected.state_hash


def processes():
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            yield Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
        except OSError:
            continue


@pytest.mark.long
def test_cost_of_a_hanging_engine(faulty, tmp_path):
    hanging = [faulty_slot("hang", v=float(v)) for v in range(1, 6)]
    elsewhere = Slot("bounce", (), 2, "faulty", "none", DT)
    store, said = Store(tmp_path), StringIO()
    run = run_plan(store, "hangs", [*hanging, elsewhere], Console(file=said, width=200), jobs=1, timeout=8.0)
    found = store.observations(run)
    assert [o.slot for o in found if o.outcome is Outcome.TIMED_OUT] == hanging[:MOST_TIMEOUTS]
    assert len(found) == MOST_TIMEOUTS + 1
    assert not run.finished
    assert "not run: 2 cases, faulty has timed out 3 times on impact" in said.getvalue()
    assert "the same command resumes it" in said.getvalue()


def test_plugins_that_exit_on_import_as_table_lines(faulty, tmp_path):
    def command(*arguments):
        return CliRunner().invoke(main, arguments)

    listed = command("list", "engines", "--json")
    assert listed.exit_code == 0, listed.stderr
    engines = {entry["name"]: entry for entry in json.loads(listed.stdout)}
    said = {"import_abort": "SIGABRT", "import_segfault": "SIGSEGV", "import_exit": "exit code 0",
            "import_leave": "SystemExit", "import_interrupt": "KeyboardInterrupt", "import_steering": "first",
            "import_nothing": "package_that_is_not_there"}  # fmt: skip
    for name, reason in said.items():
        assert reason in engines[name]["reason"] and engines[name]["reason"].isprintable(), engines[name]
    assert engines["faulty"]["version"] == "6.6.6"
    ran = command("run", "impact", "--param", "v=6", "--dim", "2", "--engine", "import_abort", "--engine", "chipmunk",
                  "--out", str(tmp_path), "--json")  # fmt: skip
    rows = json.loads(ran.stdout)
    assert {row["outcome"] for row in rows if row["engine"] == "chipmunk"} == {"ok"}
    assert {row["outcome"] for row in rows if row["engine"] == "import_abort"} == {"crashed"}
    assert ran.exit_code == 1 and "Traceback" not in ran.stderr


def test_engine_that_loads_here_and_not_in_its_worker(faulty, monkeypatch):
    assert registry.find("faulty").engine is not None
    (faulty / "faulty_engine.py").write_text("import package_that_is_not_there\n")
    (observation,) = run_cells([faulty_slot("none", v=2.0)])
    assert observation.outcome is Outcome.CRASHED
    assert "not in its worker" in observation.reason and "package_that_is_not_there" in observation.reason
