"""What code and what machine an answer came from.

A cell's identity has two hashes of code: `adapter_hash`, of what stands between a scene and one engine's trajectory,
and `scene_code`, of the scene's own file and what that measures with. Neither knows other engines or other scenes: who
edits or adds one of those invalidates nothing else.
"""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from adapters.registry import GROUP
from validation.catalogue import CATALOGUE, module_of


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


#: What runs and measures a cell of any scene.
RUNNING = ("validation.execution", "validation.certification")


@cache
def scene_code(scene: str) -> str:
    """Hash of the code that makes and measures a scene: its own module, and what that imports of its package and ours.

    All scene files share one: their text is part of their name.
    """
    module = module_of(scene) if scene in CATALOGUE else "validation.scene_files"
    own = {"validation", module.partition(".")[0]}
    found: dict[str, Path] = {}
    left = [module]
    while left:
        name = left.pop()
        path = None if name in found else located(name)
        if path is not None and path.suffix == ".py":
            found[name] = path
            if name.partition(".")[0] in own:  # of the solver only what is imported itself: its geometry measures
                left += [each for each in _imported(path) if each.partition(".")[0] in own | {"reference_solver"}]
    return _hash_files([*found.values(), *(path for path in map(located, RUNNING) if path)])


def _imported(path: Path) -> list[str]:
    """Modules that a source file may import, by name; what turns out to be none is not located."""
    names = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return names


def code_hash(asked: Iterable[tuple[str, str]]) -> str:
    """Hash of all our code that decides what is measured where these scenes run on these engines (scene, engine)."""
    asked = list(asked)
    registered = {entry.name for entry in entry_points(group=GROUP)}
    scenes = sorted((scene, scene_code(scene)) for scene in {scene for scene, _ in asked})
    engines = sorted((name, adapter_hash(name)) for name in {engine for _, engine in asked} & registered)
    return hashlib.sha256(repr((scenes, engines)).encode()).hexdigest()[:16]


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
