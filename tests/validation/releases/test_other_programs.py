"""What git, pip and other interpreters are asked, for how long, and what becomes of each of their answers."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from validation import identity
from validation.releases import choosing, environments
from validation.releases.choosing import RegistryError, Release
from validation.releases.environments import BuildError

RELEASE = Release("toy", "1.2", "toyphysics", ("numpy<2",))


@pytest.fixture
def programs(monkeypatch):
    """`programs(answers...)`: what is asked from now on, one answer for each; an exception is raised."""
    asked, left = [], []

    def run(command, **given):
        asked.append((command, given))
        answer = left.pop(0)
        if isinstance(answer, Exception):
            raise answer
        status, out, err = answer
        return SimpleNamespace(returncode=status, stdout=out, stderr=err)

    monkeypatch.setattr(subprocess, "run", run)

    def answers(*told):
        asked.clear()
        left[:] = told
        return asked

    return answers


LATE = subprocess.TimeoutExpired("x", 1.0)


def test_commit_id_with_a_plus_for_local_changes(programs):
    for told, commit in (
        (((0, "abc123\n", ""), (0, "", "")), "abc123"), (((0, "abc123\n", ""), (0, " M file\n", "")), "abc123+"),
        (((0, "abc123\n", ""), (0, "\n", "")), "abc123"), (((128, "no repository", ""),), ""),
        ((OSError("no git"),), ""), ((LATE,), ""), (((0, "abc123\n", ""), LATE), ""),
    ):  # fmt: skip
        asked = programs(*told)
        assert identity.commit() == commit
        root = ["git", "-C", str(Path(identity.__file__).resolve().parent.parent)]
        how = {"capture_output": True, "text": True, "timeout": 10}
        wanted = [([*root, "rev-parse", "--short=12", "HEAD"], how), ([*root, "status", "--porcelain"], how)]
        assert asked == wanted[: len(told)]


def test_registry_list_with_a_time_limit(programs):
    asked = programs((0, "toy (2.0)\nAvailable versions: 2.0, 1.10, 1.9, 2.1b1, dead-beef\nINSTALLED: none\n", "odd"))
    assert [str(each) for each in choosing._listed("toy")] == ["2.0", "1.10", "1.9"]
    command = [sys.executable, "-m", "pip", "index", "versions", "toy", "--disable-pip-version-check"]
    assert asked == [(command, {"capture_output": True, "text": True, "timeout": choosing.PATIENCE})]
    silent = "releases: the package registry does not answer for toy"
    none = "releases: the package registry has no list of toy: "
    for told, said in (
        (LATE, silent), (OSError("no pip"), silent), ((0, "nothing of it", ""), f"{none}pip gave no list"),
        ((1, "Available versions: 1.0", "so\nERROR: first\nERROR: no such thing\nbye"), f"{none}no such thing"),
    ):  # fmt: skip
        programs(told)
        with pytest.raises(RegistryError) as error:
            choosing._listed("toy")
        assert str(error.value) == said


def test_pip_installs_of_wheels_alone_with_one_line_errors(programs, monkeypatch, tmp_path):
    asked = programs((0, "", "ERROR: none\n"))
    environments._install(tmp_path, RELEASE)
    ((command, how),) = asked
    assert how == {"capture_output": True, "text": True, "timeout": environments.PATIENCE}
    assert command == [
        sys.executable, "-m", "pip", "--python", str(environments._python(tmp_path)), "install", "--quiet",
        "--no-input", "--disable-pip-version-check", "--only-binary", ":all:", "toyphysics==1.2", "numpy<2",
    ]  # fmt: skip
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    wheel = f"cannot be installed: there is no wheel of toyphysics 1.2 for Python {here} here"
    for told, said in (
        (LATE, f"environment: toy==1.2: pip took longer than {environments.PATIENCE:g} s"),
        ((1, "", "ERROR: first\nERROR: no space\nmore"), "cannot be installed: no space"),
        ((1, "", "one\nKilled\n"), "cannot be installed: Killed"),
        ((1, "", "ERROR: No matching distribution found for x"), wheel),
        ((1, "", "ERROR: Could not find a version that satisfies x"), wheel),
    ):
        programs(told)
        with pytest.raises(BuildError) as error:
            environments._install(tmp_path, RELEASE)
        assert str(error.value) == said
    monkeypatch.setattr(environments, "find_spec", lambda name: None)
    with pytest.raises(BuildError) as error:
        environments._install(tmp_path, RELEASE)
    assert str(error.value) == (
        "environment: pip is not installed beside this command; python -m ensurepip brings it"
    )  # fmt: skip


def test_version_and_packages_of_a_new_interpreter(programs, tmp_path):
    asked = programs((0, '{"python": "3.11.1", "packages": {"numpy": "2.0"}}', ""))
    assert environments._told_by(tmp_path) == {"python": "3.11.1", "packages": {"numpy": "2.0"}}
    command = [str(environments._python(tmp_path)), "-I", "-c", environments._TELL]
    assert asked == [(command, {"capture_output": True, "text": True, "timeout": 120.0})]
    programs((1, "", f"{'x' * 400} it\tbroke"))
    with pytest.raises(BuildError, match=r"^environment: its interpreter does not run: x+ it broke$") as error:
        environments._told_by(tmp_path)
    assert str(error.value).count("x") < 300
