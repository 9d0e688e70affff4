"""Environments are built once, trusted only when complete and unchanged, and safe against kills and company."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from adapters.engine import EngineError
from validation.releases import environments
from validation.releases.choosing import Release


def toy_release(version="1.0.0", distribution="toyphysics"):
    return Release("toy", version, distribution, ("numpy",))


@pytest.fixture(scope="session")
def wheels(released):
    """Nothing is computed in these environments: their numpy is a name."""
    return released("1.0", {"numpy.py": ""})


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory):
    """Other files share environments that have a whole numpy."""
    return tmp_path_factory.mktemp("environments")


@pytest.fixture
def made(copied):
    """An environment that a test may damage."""
    return copied(toy_release())


def test_environment_with_release_numpy_and_receipt(made):
    assert set(made.receipt["packages"]) == {"toyphysics", "numpy"}
    assert made.receipt["packages"]["toyphysics"] == "1.0.0"
    assert made.receipt["python"] == ".".join(map(str, sys.version_info[:3]))
    assert len(made.receipt["files"]) == 64
    told = subprocess.run([made.python, "-c", "import toyphysics; print(toyphysics.__version__)"], capture_output=True)
    assert told.stdout.strip() == b"1.0.0"
    assert [each.name for each in environments.found()] == [made.name]


def test_environment_built_once(made, monkeypatch):
    monkeypatch.setattr(environments, "_install", lambda *args: pytest.fail("it was installed again"))
    assert environments.build(toy_release()) == made
    assert environments.existing(toy_release()) == made


def test_imports_leave_an_environment_unchanged(made):
    subprocess.run([made.python, "-c", "import toyphysics"], check=True)
    assert environments.check(made) == ""


def test_environment_that_was_changed(made):
    (module,) = made.path.glob("lib/python*/site-packages/toyphysics.py")
    module.write_text(module.read_text() + "KEEPS = 0.5\n")
    assert "have changed since it was installed" in environments.check(made)
    assert environments.existing(toy_release()) is None
    said = []
    again = environments.build(toy_release(), said.append)
    assert environments.check(again) == "" and any("built again" in line for line in said)
    assert "0.5" not in module.read_text()


def test_added_file_in_an_environment_detected(made):
    (site,) = made.path.glob("lib/python*/site-packages")
    (site / "sitecustomize.py").write_text("")
    assert environments.check(made)


def test_an_environment_without_its_interpreter_is_noticed(made):
    made.python.unlink()
    assert environments.check(made) == "its interpreter is gone"


def test_other_requirements_are_another_environment(own_cache):
    plain, old = toy_release(), Release("toy", "1.0.0", "toyphysics", ("numpy<2",))
    assert environments.name_of(plain) != environments.name_of(old)


def test_refusal_of_a_release_that_does_not_exist(own_cache):
    with pytest.raises(environments.BuildError, match=r"there is no wheel of toyphysics 9\.9"):
        environments.build(toy_release("9.9"))
    assert [path for path in environments.folder().iterdir() if path.suffix != ".lock"] == []


def test_failed_environment_in_one_line(own_cache, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")
    with pytest.raises(EngineError, match="cannot be made"):
        environments.build(toy_release())


def test_removed_environments_are_gone(made):
    environments.remove(made)
    assert environments.found() == [] and not made.path.exists()


#: Builds in a process of its own; `SLOW` stops in the middle of the installation, where some of it is there already.
BUILDER = """
import pathlib, sys, time
from validation.releases import environments
from validation.releases.choosing import Release

install, mark, slow = environments._install, pathlib.Path(sys.argv[1]), float(sys.argv[2])

def watched(path, release):
    install(path, release)
    with mark.open("a") as stream:
        stream.write(path.name + "\\n")
    time.sleep(slow)

environments._install = watched
print(environments.build(Release("toy", "1.0.0", "toyphysics", ("numpy",))).path)
"""


def builder(mark, slow):
    command = [sys.executable, "-c", BUILDER, str(mark), str(slow)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(found, seconds=60.0):
    ends = time.monotonic() + seconds
    while not (value := found()) and time.monotonic() < ends:
        time.sleep(0.02)
    return value


def test_killed_installation_not_trusted(own_cache, tmp_path):
    mark = tmp_path / "installed"
    process = builder(mark, 600.0)
    assert wait_for(mark.exists), process.communicate()
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert environments.found() == []
    left = list(environments.folder().glob(f"{environments.UNFINISHED}*"))
    assert left  # it was in the middle of it: files are there, and none of them counts
    made = environments.build(toy_release())
    assert environments.check(made) == ""
    assert not list(environments.folder().glob(f"{environments.UNFINISHED}*"))


def test_kill_between_receipt_and_name_not_trusted(made):
    made.path.rename(made.path.with_name(f"{environments.UNFINISHED}{made.name}-left"))
    assert environments.found() == []


def test_one_installation_for_two_processes(own_cache, tmp_path):
    mark = tmp_path / "installed"
    both = [builder(mark, 1.0), builder(mark, 1.0)]
    told = [process.communicate(timeout=120) for process in both]
    assert [process.returncode for process in both] == [0, 0], told
    assert len({out for out, _ in told}) == 1
    assert len(mark.read_text().splitlines()) == 1


def test_folder_of_an_environment_without_a_receipt(own_cache):
    path = environments.folder() / environments.name_of(toy_release())
    (path / "bin").mkdir(parents=True)
    (path / "bin" / "python").write_text("")
    assert environments.found() == []
    assert environments.check(environments.build(toy_release())) == ""


def test_environment_with_an_invalid_receipt(made):
    (made.path / environments.RECEIPT).write_text("[1, 2")
    assert environments.found() == []
    (made.path / environments.RECEIPT).write_text(json.dumps([1]))
    assert environments.found() == []


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="no such locks")
def test_the_lock_ends_with_its_process(own_cache, tmp_path):
    mark = tmp_path / "installed"
    process = builder(mark, 600.0)
    assert wait_for(mark.exists)
    waiting = builder(tmp_path / "second", 0.0)
    time.sleep(0.5)
    assert waiting.poll() is None  # it waits for the first one
    process.kill()
    out, err = waiting.communicate(timeout=120)
    assert waiting.returncode == 0, err
    assert len(environments.found()) == 1 and str(environments.found()[0].path) == out.strip()
    process.communicate()
