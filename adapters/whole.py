"""Files that are written whole or not at all, and the folder of those that can be made again."""

from __future__ import annotations

import os
from pathlib import Path


def write(path: Path, content: str | bytes) -> None:
    """Write a file under another name, and rename it: a reader or a kill never finds half of it.

    A device, and a file in a folder that may not be written, is written as it is; a link that leads to itself is
    replaced.
    """
    path, data = Path(os.path.realpath(path)), content.encode() if isinstance(content, str) else content
    if (path.exists() and not path.is_file()) or not os.access(path.parent, os.W_OK):
        path.write_bytes(data)
        return
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_bytes(data)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def cache_folder() -> Path:
    """Folder for data that can be made again, as in `reference_solver.caches`.

    Both have it: results of an engine that imports the solver are stale after each edit of the solver.
    """
    if os.name == "nt" and os.environ.get("LOCALAPPDATA"):
        return Path(os.environ["LOCALAPPDATA"]) / "contact-crosscheck"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "contact-crosscheck"
