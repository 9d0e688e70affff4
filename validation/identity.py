"""Identity of the code and the machine of a result.

A cell's identity has two hashes of code: `adapter_hash`, of the code between a scene and one engine's trajectory, and
`scene_code`, of the scene's file and its metrics. Neither depends on other engines or scenes, so a change of one of
those invalidates nothing else.
"""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import Any

from adapters import registry
from adapters.engine_folder import folder_of, located
from validation.catalogue import CATALOGUE, module_of


def _hash_files(paths: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def _sources(package: str) -> list[Path]:
    """Source files of a package, found without importing it (the solver would load its compiler)."""
    spec = find_spec(package)
    folders = list(spec.submodule_search_locations or []) if spec else []
    return [path for folder in folders for path in Path(folder).rglob("*.py")]


@cache
def adapter_hash(engine: str) -> str:
    """Hash of our code between a scene and this engine's trajectory.

    The shared types and step loop, the engine's adapter with its imports from its package and the programs that it
    starts, and for our solver's adapter the solver. Laws, experiments and findings judge a trajectory and are not part
    of it.
    """
    entry = registry.entry(engine)
    folders = {folder_of(name) for name in registry.names()}
    shared = [path for path in _sources("adapters") if path.parent not in folders and path.parent.name not in JUDGING]
    if registry.is_introduced(engine):  # its source may not be a file; its cells are not stored
        return _hash_files(shared)
    if entry is None:
        raise KeyError(engine)
    own = _closure(entry.module, {entry.module.partition(".")[0]}, {SOLVER})
    inside = _sources(SOLVER)
    solver = inside if set(inside) & set(own) else []
    found = None if registry.is_ours(entry) else registry.find(engine).engine
    return _hash_files(sorted({*shared, *own, *solver, *(found.sources if found is not None else ())}))


#: Rooms of `adapters` that judge a trajectory, and what a new adapter begins with.
JUDGING = {"law", "experiment", "conformance", "new_adapter"}
#: Our solver.
SOLVER = "reference_solver"
#: Code that runs and measures a cell of any scene.
RUNNING = ("validation.running.execution", "validation.running.certification")


@cache
def scene_code(scene: str) -> str:
    """Hash of the code that makes and measures a scene: its module, and its imports from its package and ours.

    All scene files share one: their text is part of their name.
    """
    module = module_of(scene) if scene in CATALOGUE else "validation.files.scene_files"
    # Of the solver only directly imported files: its geometry is used in metrics.
    own = _closure(module, {"validation", module.partition(".")[0]}, {SOLVER})
    return _hash_files([*own, *(path for path in map(located, RUNNING) if path)])


def _closure(module: str, inner: set[str], rim: set[str]) -> list[Path]:
    """Files of a module and of its imports from the packages ``inner``; from those in ``rim`` only the first file."""
    found: dict[str, Path] = {}
    left = [module]
    while left:
        name = left.pop()
        path = None if name in found else located(name)
        if path is not None and path.suffix == ".py":
            found[name] = path
            if name.partition(".")[0] in inner:
                left += [each for each in _imported(name, path) if each.partition(".")[0] in inner | rim]
    return list(found.values())


def _imported(module: str, path: Path) -> tuple[str, ...]:
    """Names that a source file may import as modules; those that are not modules are not found."""
    return _named(path.read_bytes(), module if path.name == "__init__.py" else module.rpartition(".")[0])


@cache
def _named(source: bytes, package: str) -> tuple[str, ...]:
    """Modules that a source in ``package`` names; scenes share most of theirs, and each is read for every scene."""
    names: list[str] = []
    for node in _statements(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            named = "." * node.level + (node.module or "")
            try:
                named = resolve_name(named, package)
            except ImportError:  # beyond the top of its package
                continue
            names += [named, *(f"{named}.{alias.name}" for alias in node.names)]
    return tuple(names)


def _statements(module: ast.Module) -> Iterator[ast.AST]:
    """Statements at any depth; expressions, which are most of a module and import nothing, are not walked through."""
    left: list[ast.AST] = [module]
    while left:
        for node in ast.iter_child_nodes(left.pop()):
            if not isinstance(node, ast.expr):
                left.append(node)
                yield node


def code_hash(asked: Iterable[tuple[str, str]]) -> str:
    """Hash of all our code that affects the results of these scenes on these engines (scene, engine)."""
    asked = list(asked)
    registered = set(registry.names())
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
    """CPU, cores, memory, system and Python: facts that affect times and last bits."""
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
