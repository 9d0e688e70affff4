"""The faulty plugins, installed as other people's packages; the size of the suite and its seed."""

import os
import random
import shutil
import sys
from pathlib import Path

import pytest

from adapters import registry

HERE = Path(__file__).parent
#: What a plugin does while it is imported.
IMPORTS = {
    "import_abort": "import os; os.abort()",
    "import_segfault": "import ctypes; ctypes.string_at(0)",
    "import_exit": "import os; os._exit(0)",
    "import_leave": "import sys; sys.exit(0)",
    "import_interrupt": "raise KeyboardInterrupt",
    "import_steering": "raise RuntimeError('\\x1b[2J first\\nsecond')",
    "import_nothing": "import package_that_is_not_there",
}


def pytest_report_header(config):
    return f"chaos: seed {os.environ.get('CROSSCHECK_SEED', 2026)}, soak {bool(os.environ.get('CROSSCHECK_SOAK'))}"


@pytest.fixture(scope="session")
def soak():
    """Whether all of it is run (`make soak`), or what fits into continuous integration."""
    return bool(os.environ.get("CROSSCHECK_SOAK"))


@pytest.fixture(scope="session")
def every(soak):
    """Whether all kinds are met, as in `make test-all`, or some of each."""
    return soak or bool(os.environ.get("CROSSCHECK_ALL"))


@pytest.fixture
def dice(request):
    """Random numbers of this test; the seed is printed, and CROSSCHECK_SEED sets it."""
    seed = int(os.environ.get("CROSSCHECK_SEED", 2026))
    print(f"CROSSCHECK_SEED={seed}")
    return random.Random(f"{seed} {request.node.name}")


@pytest.fixture
def faulty(tmp_path_factory, monkeypatch):
    """Install `faulty`, and one engine for each thing that a plugin may do while it is imported."""
    folder = tmp_path_factory.mktemp("faulty")
    shutil.copy(HERE / "faulty_engine.py", folder)
    entries = "faulty = faulty_engine:FaultyEngine\n"
    for name, code in IMPORTS.items():
        (folder / f"{name}.py").write_text(code + "\n")
        entries += f"{name} = {name}:Engine\n"
    info = folder / "faulty-6.6.6.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 6.6.6\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\n{entries}")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder))
    registry.forget()
    yield folder
    registry.forget()
    for name in ("faulty_engine", *IMPORTS):
        sys.modules.pop(name, None)
