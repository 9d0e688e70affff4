"""Our code for an environment, in the layout of an installation without dependencies.

    <cache>/contact-crosscheck/code/<hash>/     adapters, validation, reference_solver; their metadata and entry points;
                                                the packages of the plugins used (engines, scenes)

It is a copy of the running code, including uncommitted edits, so that the same code runs and judges a release. The copy
is named after the hash of its content: it never changes, and environments share it.
"""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import time
from collections.abc import Iterable
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path

from adapters import registry
from adapters.engine import EngineError
from adapters.whole import cache_folder
from validation import catalogue
from validation.releases.environments import UNFINISHED

#: Our packages that run and measure a cell; reports are made in the calling process.
PACKAGES = ("reference_solver", "adapters", "validation")
#: Entry points of engines and scenes.
GROUPS = (registry.GROUP, catalogue.GROUP)
#: Seconds after which an unused copy may be deleted: a month.
KEPT = 30 * 86400.0


def code(engine: str, scenes: Iterable[str]) -> Path:
    """Folder for the path of an interpreter that runs ``scenes`` on ``engine``.

    Raises
    ------
    EngineError
        If the source of a plugin is not a file that can be copied.
    """
    entries = [e for e in registry.installed(registry.GROUP) if e.name == engine or registry.is_ours(e)]
    wanted = set(scenes)
    entries += [e for e in registry.installed(catalogue.GROUP) if e.name in wanted]
    modules = list(dict.fromkeys([*PACKAGES, *(entry.module.partition(".")[0] for entry in entries)]))
    sources = {name: _source(name) for name in modules}
    listed = _entry_points(entries)
    path = cache_folder() / "code" / _hash(sources, listed)
    if not path.is_dir():
        _lay_out(path, sources, listed)
    _touch(path)
    return path


def _source(module: str) -> Path:
    """Folder of a package, or file of a module; found without importing it."""
    spec = find_spec(module)
    places = list(spec.submodule_search_locations or []) if spec else []
    path = Path(places[0]) if places else Path(spec.origin) if spec and spec.origin else None
    if path is None or not path.exists():
        raise EngineError(f"engine: the source of {module} is not a file that can be run elsewhere")
    return path


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    return sorted(p for p in path.rglob("*") if p.is_file() and "__pycache__" not in p.parts)


def _hash(sources: dict[str, Path], listed: str) -> str:
    digest = hashlib.sha256(listed.encode())
    for name, path in sorted(sources.items()):
        for file in _files(path):
            digest.update(f"{name}/{file.relative_to(path).as_posix()}\0".encode())
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:16]


def _entry_points(entries: Iterable[EntryPoint]) -> str:
    entries = list(entries)
    lines = []
    for group in GROUPS:
        lines += [f"[{group}]", *sorted(f"{e.name} = {e.value}" for e in entries if e.group == group), ""]
    return "\n".join(lines)


def _lay_out(path: Path, sources: dict[str, Path], listed: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    _sweep(path.parent)
    made = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=path.parent))
    try:
        for name, source in sources.items():
            if source.is_file():
                shutil.copy(source, made / source.name)
            else:
                shutil.copytree(source, made / name, ignore=shutil.ignore_patterns("__pycache__"))
        info = made / "contact_crosscheck-0.dist-info"
        info.mkdir()
        metadata = "Metadata-Version: 2.1\nName: contact-crosscheck\nVersion: 0\n"
        (info / "METADATA").write_text(metadata, encoding="utf-8")
        (info / "entry_points.txt").write_text(listed, encoding="utf-8")
        made.rename(path)
    except OSError:
        if not path.is_dir():  # else another process has made the same copy
            raise
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _sweep(folder: Path) -> None:
    """Remove copies that have not been used for long, and incomplete ones."""
    for old in folder.iterdir():
        age = time.time() - old.stat().st_mtime
        if age > (3600.0 if old.name.startswith(UNFINISHED) else KEPT):
            shutil.rmtree(old, ignore_errors=True)


def _touch(path: Path) -> None:
    """Note that the copy is in use."""
    try:
        path.touch()
    except OSError:
        return
