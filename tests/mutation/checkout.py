"""A copy of the checkout in which modules are changed, so that the checkout itself never is."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from subjects import ROOT


def copy_of_the_checkout(folder: Path) -> None:
    """Everything that is tracked or new, but what is published."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    for name in filter(None, names.decode().split("\0")):
        if not name.startswith("reports/published/") and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
