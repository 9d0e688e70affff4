"""What is kept of the machine that made a run."""

import ast
import os
import platform
from collections import Counter
from types import SimpleNamespace

from validation import identity
from validation.cells import Slot, prepare


def test_machine_facts_for_times_and_last_bits(monkeypatch):
    monkeypatch.setattr(identity, "_cpu_name", lambda: "a fast one")
    found = identity.machine()
    assert list(found) == ["cpu", "cores", "memory_gib", "system", "machine", "python"]
    assert (found["cpu"], found["cores"], found["machine"]) == ("a fast one", os.cpu_count(), platform.machine())
    assert found["system"] == f"{platform.system()} {platform.release()}"
    assert found["python"] == platform.python_version()
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 2**19 + 2**16}
    monkeypatch.setattr(identity.os, "sysconf", pages.__getitem__)
    monkeypatch.setattr(identity.os, "cpu_count", lambda: None)
    found = identity.machine()
    assert (found["memory_gib"], found["cores"]) == (2.2, 0)  # two and a quarter GiB, to a tenth


def test_cpu_name_by_system_or_kind(monkeypatch, tmp_path):
    place = tmp_path / "cpuinfo"
    monkeypatch.setattr(identity, "Path", lambda name: place if name == "/proc/cpuinfo" else None)
    place.write_text("processor : 0\nmodel name\t: A Fast One @ 3 GHz: rev 2\nmodel name : another\n")
    assert identity._cpu_name() == "A Fast One @ 3 GHz: rev 2"
    monkeypatch.setattr(identity.platform, "processor", lambda: "")
    monkeypatch.setattr(identity.platform, "machine", lambda: "riscv64")
    place.write_text("processor : 0\n")
    assert identity._cpu_name() == "riscv64"
    place.unlink()
    monkeypatch.setattr(identity.platform, "processor", lambda: "x86")
    assert identity._cpu_name() == "x86"


def test_sources_hashed_and_parsed_once_per_process(monkeypatch):
    hashed, read, hash_files = [], Counter(), identity._hash_files
    monkeypatch.setattr(identity, "_hash_files", lambda files: hashed.append(files) or hash_files(files))
    parse = {"parse": lambda text: read.update([text]) or ast.parse(text)}
    monkeypatch.setattr(identity, "ast", SimpleNamespace(**vars(ast) | parse))
    for each in (identity.adapter_hash, identity.scene_code, identity._named):
        each.cache_clear()
    profiles = {"reference": "classical", "chipmunk": "default"}
    asked = [(scene, engine) for scene in ("impact", "bounce", "stack") for engine in profiles]
    for _ in range(2):
        identity.code_hash(asked)
        for scene, engine in asked:
            prepare(Slot(scene, (), 2, engine, profiles[engine], 1 / 240)).cell.key()
    assert len(hashed) == 5 and len(read) > 20 and set(read.values()) == {1}
