"""The folder of data that can be made again."""

import os
from pathlib import Path


def base_folder() -> Path:
    """Return ``contact-crosscheck`` in the user's cache folder (``XDG_CACHE_HOME``, else ``~/.cache``)."""
    if os.name == "nt" and os.environ.get("LOCALAPPDATA"):
        return Path(os.environ["LOCALAPPDATA"]) / "contact-crosscheck"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "contact-crosscheck"
