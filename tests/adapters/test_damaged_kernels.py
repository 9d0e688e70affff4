"""Marks that all kernels are compiled are of these sources; files that a power cut has damaged take them away."""

import os
import subprocess
import sys
from io import BytesIO
from pickletools import genops

import pytest

from adapters import registry
from adapters.plain import Notice, is_visible
from adapters.reference import engine
from reference_solver import compilation

KERNEL = "import numba\n\n@numba.njit(cache=True)\ndef double(x):\n    return x + x\n\nprint(double(1.5))\n"


def first_pickle(data):
    stream = BytesIO(data)
    list(genops(stream))
    return data[: stream.tell()]


DAMAGE = {
    "empty": lambda data: b"",
    "cut": lambda data: data[: len(data) // 2],
    "zeros": lambda data: bytes(len(data)),
    "garbage": lambda data: b"\xffgarbage" * 100,
    "cut after its first part": lambda data: first_pickle(data) if first_pickle(data) != data else b"",
    "twice": lambda data: data + data,
    "cut after a full stop": lambda data: data[: data.rindex(b".", 0, len(data) - 1) + 1],
}


@pytest.fixture(scope="module")
def called(tmp_path_factory):
    """A function that calls a small kernel in another process, and the folder of its machine code."""
    folder = tmp_path_factory.mktemp("kernel")
    (folder / "small.py").write_text(KERNEL)
    (folder / "compiled-0").write_text("a mark")

    def call():
        own = os.environ | {"NUMBA_CACHE_DIR": str(folder)}
        return subprocess.run([sys.executable, str(folder / "small.py")], env=own, capture_output=True, text=True)

    assert call().stdout.strip() == "3.0"
    return call, folder


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_file_of_a_kernel(called, ending, kind):
    _, folder = called
    files = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    (damaged,) = folder.rglob(f"*.{ending}")
    damaged.write_bytes(DAMAGE[kind](files[damaged]))
    try:
        with pytest.warns(Notice) as said:
            engine._heal(folder)
        assert len(said) == 1 and is_visible(str(said[0].message))
        others = {path for path in files if path.parent != folder} - {damaged}
        assert others == {path for path in folder.rglob("*.nb[ic]")}
        assert not (folder / "compiled-0").exists()
    finally:
        for path, data in files.items():
            path.write_bytes(data)


def test_undamaged_kernels(called, recwarn):
    _, folder = called
    before = {path for path in folder.rglob("*")}
    engine._heal(folder)
    assert before == {path for path in folder.rglob("*")} and not recwarn.list


def test_kernel_with_an_empty_index(called):
    """It cannot be called at all until the file is thrown away, and then is compiled again."""
    call, folder = called
    (index,) = folder.rglob("*.nbi")
    index.write_bytes(b"")
    assert "Ran out of input" in call().stderr
    with pytest.warns(Notice):
        engine._heal(folder)
    (folder / "small.py").write_text(KERNEL)
    assert call().stdout.strip() == "3.0" and index.stat().st_size > 0


@pytest.mark.parametrize(
    ("file", "covered"),
    [("coulomb.py", True), ("exact/kernels/rows.py", True), ("exact/cones.py", True), ("certificate/truth.py", False)],
)
def test_marks_of_compiled_kernels_after_an_edit(tmp_path, monkeypatch, file, covered):
    """A run looks for marks: with one of other sources it would compile without a word."""
    source = tmp_path / file
    source.parent.mkdir(parents=True, exist_ok=True)
    source.write_text("x = 1")
    monkeypatch.setattr(compilation, "__file__", str(tmp_path / "compilation.py"))
    monkeypatch.setattr(compilation.config, "CACHE_DIR", str(tmp_path / "kept"))
    before = registry.load("reference").kernels()
    source.write_text("x = 2")
    assert (registry.load("reference").kernels() != before) == covered


def test_damaged_kernels_of_the_event_loop(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation.config, "CACHE_DIR", str(tmp_path))
    damaged = compilation.cache_folder("exact/kernels") / "sweep.nbi"
    mark = registry.load("reference").kernels() / "compiled-0"
    for path in (damaged, mark):
        path.write_text("")
    with pytest.warns(Notice):
        assert registry.load("reference").kernels() == mark.parent
    assert not damaged.exists() and not mark.exists()
