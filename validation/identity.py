"""What code and what machine an answer came from."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from adapters.registry import GROUP


def _hash_files(paths: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def located(module: str) -> Path | None:
    """File of a module, found without importing the packages it is in: a plugin's import may do anything."""
    first, *rest = module.split(".")
    spec = find_spec(first)
    for name in rest:
        if spec is None or spec.submodule_search_locations is None:
            return None
        spec = PathFinder.find_spec(f"{spec.name}.{name}", spec.submodule_search_locations)
    return Path(spec.origin) if spec and spec.origin and spec.has_location else None


def _sources(package: str) -> list[Path]:
    """Source files of a package, found without importing it (the solver would load its compiler)."""
    spec = find_spec(package)
    folders = list(spec.submodule_search_locations or []) if spec else []
    return [path for folder in folders for path in Path(folder).rglob("*.py")]


@cache
def adapter_hash(engine: str) -> str:
    """Hash of everything of ours between a scene and this engine's trajectory.

    The shared vocabulary and step loop, the engine's own adapter file, and for the reference engine its solver.
    """
    entry = {e.name: e for e in entry_points(group=GROUP)}[engine]
    path = located(entry.module)
    own = [path] if path else []
    modules = {e.module.rsplit(".", 1)[-1] for e in entry_points(group=GROUP)}
    mine = entry.module.rsplit(".", 1)[-1]
    # An adapter and the law file beside it belong to one engine; what belongs to none is shared.
    owner = {path: next((m for m in modules if path.stem in (m, f"{m}_law")), None) for path in _sources("adapters")}
    shared = [path for path, name in owner.items() if name is None or name == mine]
    solver = _sources("reference_solver") if entry.module == "adapters.reference" else []
    return _hash_files(sorted({*shared, *own, *solver}))


@cache
def code_hash() -> str:
    """Hash of all our code that decides stored measurements (not of what judges or shows them)."""
    return _hash_files([*_sources("adapters"), *_sources("reference_solver"), *_sources("validation")])


def commit() -> str:
    """Commit of the checkout, with ``+`` if it has uncommitted changes; empty outside a checkout."""
    root = Path(__file__).resolve().parent.parent
    try:
        head = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "--short=12", "HEAD"],
            capture_output=True,
            text=True,
            timeout=10,
        )
        if head.returncode:
            return ""
        status = subprocess.run(
            ["git", "-C", str(root), "status", "--porcelain"], capture_output=True, text=True, timeout=10
        )
        return head.stdout.strip() + ("+" if status.stdout.strip() else "")
    except (OSError, subprocess.TimeoutExpired):
        return ""


def machine() -> dict[str, Any]:
    """CPU, cores, memory, system and Python: what a time means, and what may move a last bit."""
    return {
        "cpu": _cpu_name(),
        "cores": os.cpu_count() or 0,
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
        "system": f"{platform.system()} {platform.release()}",
        "machine": platform.machine(),
        "python": platform.python_version(),
    }


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
