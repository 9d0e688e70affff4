"""Environments: one per release of an engine, built once under the user's cache folder.

    <cache>/contact-crosscheck/environments/myengine-3.2.7-cp311-1a2b3c4d/     a virtual environment
        receipt.json    written last: interpreter, packages with versions, hash of all files

An environment is made under a temporary name and renamed when it is complete, so an interrupted one never counts; the
next build of the same one removes it. A lock of the operating system, which ends with its process, keeps two processes
from the same work. Before an environment is used its files are hashed again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from adapters.engine import EngineError
from adapters.plain import one_line
from adapters.whole import cache_folder
from validation.releases.choosing import Release

RECEIPT = "receipt.json"
#: Prefix of an unfinished environment; no release has this name.
UNFINISHED = ".building-"
#: Seconds for pip to fetch and unpack one release; the largest wheels take half a minute.
PATIENCE = 900.0
#: Files outside the hash: compiled files appear when modules are first imported.
_COMPILED = "__pycache__"


class BuildError(EngineError):
    """A release cannot be installed; one line."""


@dataclass(frozen=True)
class Environment:
    """A complete environment: its folder and receipt."""

    path: Path
    receipt: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of its folder."""
        return self.path.name

    @property
    def python(self) -> Path:
        """Its interpreter."""
        return _python(self.path)


def folder() -> Path:
    """Folder of all environments."""
    return cache_folder() / "environments"


def name_of(release: Release) -> str:
    """Folder name: engine, version, interpreter, and a digest of pip's requirements."""
    digest = hashlib.sha256("\n".join(release.requirements).encode()).hexdigest()[:8]
    tag = f"{'cp' if sys.implementation.name == 'cpython' else 'py'}{sys.version_info.major}{sys.version_info.minor}"
    return f"{release.engine}-{release.version}-{tag}-{digest}"


def found() -> list[Environment]:
    """All complete environments, by name."""
    paths = sorted(folder().iterdir()) if folder().is_dir() else []
    environments = (_read(path) for path in paths if not path.name.startswith("."))
    return [environment for environment in environments if environment is not None]


def existing(release: Release) -> Environment | None:
    """The environment of a release if it is complete and unchanged; else None."""
    environment = _read(folder() / name_of(release))
    return environment if environment is not None and not check(environment) else None


def build(release: Release, say: Callable[[str], None] = lambda line: None) -> Environment:
    """Return the environment of a release; a missing or changed one is built.

    Raises
    ------
    BuildError
        If it cannot be made; nothing is left behind.
    """
    try:
        folder().mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BuildError(f"environment: {folder()} cannot be made: {error.strerror}") from None
    path = folder() / name_of(release)
    with locked(folder() / f".{path.name}.lock", lambda: say(f"waiting for another process that builds {path.name}")):
        environment = _read(path)
        if environment is not None:
            wrong = check(environment)
            if not wrong:
                return environment
            say(f"{path.name}: {wrong}; it is built again")
            shutil.rmtree(path)
        for left in folder().glob(f"{UNFINISHED}{path.name}-*"):  # left by a killed process, as we hold the lock
            shutil.rmtree(left, ignore_errors=True)
        if path.exists():  # without a receipt: not trusted
            shutil.rmtree(path)
        say(f"installing {' '.join(release.requirements)}")
        return _made(release, path)


def _made(release: Release, path: Path) -> Environment:
    unfinished = Path(tempfile.mkdtemp(prefix=f"{UNFINISHED}{path.name}-", dir=path.parent))
    try:
        venv.create(unfinished, with_pip=False, symlinks=os.name != "nt")
        _install(unfinished, release)
        receipt = {
            "engine": release.engine,
            "version": release.version,
            "requirements": list(release.requirements),
            **_told_by(unfinished),
            "files": _hash(unfinished),
        }
        text = json.dumps(receipt, indent=1)
        (unfinished / RECEIPT).write_text(text, encoding="utf-8")
        unfinished.rename(path)
    except BuildError:
        raise
    except (OSError, subprocess.SubprocessError) as error:
        raise BuildError(f"environment: {release.name} cannot be built: {one_line(error)}") from None
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return Environment(path, receipt)


def _install(path: Path, release: Release) -> None:
    """Install the release with pip; wheels only, as a build from sources may take an hour."""
    if find_spec("pip") is None:
        raise BuildError("environment: pip is not installed beside this command; python -m ensurepip brings it")
    command = [sys.executable, "-m", "pip", "--python", str(_python(path)), "install", "--quiet", "--no-input"]
    command += ["--disable-pip-version-check", "--only-binary", ":all:", *release.requirements]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        raise BuildError(f"environment: {release.name}: pip took longer than {PATIENCE:g} s") from None
    if done.returncode:
        errors = [line for line in done.stderr.splitlines() if line.startswith("ERROR: ")]
        why = errors[-1].removeprefix("ERROR: ") if errors else done.stderr.strip().rpartition("\n")[2]
        if "No matching distribution" in why or "Could not find a version" in why:
            why = f"there is no wheel of {release.distribution} {release.version} for Python {_short()} here"
        raise BuildError(f"cannot be installed: {one_line(why)}")


def _short() -> str:
    return f"{sys.version_info.major}.{sys.version_info.minor}"


_TELL = """
import importlib.metadata as m, json, platform, sys
packages = sorted((d.metadata["Name"].lower(), d.version) for d in m.distributions(path=sys.path[-1:]))
print(json.dumps({"python": platform.python_version(), "implementation": sys.implementation.name,
                  "platform": platform.platform(), "packages": dict(packages)}))
"""


def _told_by(path: Path) -> dict[str, Any]:
    """Report of the new interpreter about itself and its packages."""
    command = [str(_python(path)), "-I", "-c", _TELL]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0)
    if done.returncode:
        raise BuildError(f"environment: its interpreter does not run: {one_line(done.stderr[-300:])}")
    return dict(json.loads(done.stdout))


def check(environment: Environment) -> str:
    """Why an environment does not fit its receipt; empty if it does."""
    receipt = environment.receipt
    if not environment.python.exists():
        return "its interpreter is gone"
    if receipt.get("files") != _hash(environment.path):
        return "its files have changed since it was installed"
    return ""


def remove(environment: Environment) -> None:
    """Delete an environment; a partly deleted one never has its name."""
    with locked(folder() / f".{environment.name}.lock"):
        away = Path(tempfile.mkdtemp(prefix=f"{UNFINISHED}{environment.name}-", dir=folder()))
        environment.path.rename(away / "removed")
        shutil.rmtree(away)


def size(environment: Environment) -> int:
    """Bytes of its files."""
    return sum(file.lstat().st_size for file in environment.path.rglob("*") if file.is_file())


def _python(path: Path) -> Path:
    return path / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _read(path: Path) -> Environment | None:
    try:
        receipt = json.loads((path / RECEIPT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return Environment(path, receipt) if isinstance(receipt, dict) else None


def _hash(path: Path) -> str:
    """Hash over names and contents of all installed files except compiled ones."""
    digest = hashlib.sha256()
    places = sorted(path.glob("lib*/python*/site-packages")) or [path / "Lib" / "site-packages"]
    for root in dict.fromkeys(place.resolve() for place in places):
        for file in sorted(root.rglob("*")):
            inside = file.relative_to(root)
            if _COMPILED in inside.parts or not file.is_file():
                continue
            digest.update(inside.as_posix().encode() + b"\0")
            with file.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()


@contextlib.contextmanager
def locked(path: Path, waiting: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Hold the lock at ``path``; it is released when the process ends, however it ends.

    On systems without such locks two processes may both build: one of them renames, the other's work is lost.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    with path.open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            waiting()
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield
