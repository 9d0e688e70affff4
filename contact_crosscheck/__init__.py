"""Contact scenes with known answers, run on physics engines: the command, and functions for scripts and notebooks.

    import contact_crosscheck as cc

    result = cc.run("bounce", engine="mujoco", profile="tuned", e=0.7)

Importing this package loads nothing else; each function loads what it needs when it is first used. The packages behind
it have plain names (`adapters`, `validation`, `reports`), which other distributions and a user's own folders may have
too. Before any of them is loaded, `check` makes sure that they are ours. If not, it raises one line with the name and
the place of the foreign package.
"""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

    from adapters.engine import Engine, EngineError
    from adapters.scene import SceneError
    from contact_crosscheck.cases import Result, run
    from contact_crosscheck.listings import engines, scenes
    from contact_crosscheck.models import Scene
    from contact_crosscheck.studies import Bench, bench, sweep
    from validation.records.store import StoreError

    __version__: str

__all__ = [
    "Bench",
    "Engine",
    "EngineError",
    "ForeignPackage",
    "Result",
    "Scene",
    "SceneError",
    "StoreError",
    "bench",
    "engines",
    "load",
    "run",
    "scenes",
    "sweep",
]
#: Public names that are loaded at their first use, and the module of each.
LATE = {
    "run": "contact_crosscheck.cases",
    "Result": "contact_crosscheck.cases",
    "sweep": "contact_crosscheck.studies",
    "bench": "contact_crosscheck.studies",
    "Bench": "contact_crosscheck.studies",
    "engines": "contact_crosscheck.listings",
    "scenes": "contact_crosscheck.listings",
    "Scene": "contact_crosscheck.models",
    "Engine": "adapters.engine",
    "EngineError": "adapters.engine",
    "SceneError": "adapters.scene",
    "StoreError": "validation.records.store",
}
#: Our packages, in the order in which they may import each other.
PACKAGES = ("reference_solver", "adapters", "validation", "reports")
HOME = Path(__file__).resolve().parent.parent
#: Exit status after Ctrl-C, as in `reports.command.statuses`, which is not imported for it.
INTERRUPTED = 130


class ForeignPackage(ImportError):
    """Another package has the name of one of ours and is found first."""


def foreign() -> dict[str, str]:
    """Foreign packages with names of ours, and their places; the place of one that is not found is ``nowhere``."""
    found = {}
    for name in PACKAGES:
        loaded = sys.modules.get(name)
        spec = loaded.__spec__ if loaded is not None else PathFinder.find_spec(name)
        places = list(spec.submodule_search_locations or [spec.origin or "nowhere"]) if spec else ["nowhere"]
        if Path(places[0]).resolve() != HOME / name:
            found[name] = str(places[0])
    return found


def check() -> None:
    """Make sure that our packages are ours.

    Raises
    ------
    ForeignPackage
        One line with the names of the foreign packages and their places.
    """
    wrong = foreign()
    if wrong:
        said = ", ".join(f"{name!r} at {place}" for name, place in wrong.items())
        raise ForeignPackage(
            f"contact-crosscheck: a foreign package hides one of ours: {said}; ours lie in {HOME}. Start from another "
            "folder, or use an environment without that package"
        )


def __getattr__(name: str) -> Any:
    """Load a public name at its first use."""
    if name == "__version__":
        from importlib.metadata import version

        found: Any = version("contact-crosscheck")
    elif name in LATE:
        check()
        from importlib import import_module

        found = getattr(import_module(LATE[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Public names, including those that are not loaded yet; pytest finds its hooks here as well."""
    return sorted([*__all__, "__version__", "pytest_addoption", "pytest_configure"])


def load(folder: str | Path = "crosscheck-out", run: str = "latest", nulls: bool = False) -> pd.DataFrame:
    """Load the checks of a stored run, judged with today's tolerances and lists of known failures.

    Parameters
    ----------
    folder
        Folder of the results (``crosscheck run --out``).
    run
        Id of the run, as ``crosscheck list runs`` prints it.
    nulls
        Whether rows of trivial answers follow (engine ``none``): nothing moves, nothing touches, what touches sticks.

    Returns
    -------
    pandas.DataFrame
        One row for each check of each case. ``attrs`` holds ``run``, ``commit`` and ``versions`` (of each engine).

    Raises
    ------
    ForeignPackage
        If a package on the path hides one of ours.
    StoreError
        If the folder has no results or no such run.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> rows = cc.load("crosscheck-out")
    >>> rows[rows.physics == "fail"][["engine", "profile", "scene", "metric", "value", "truth", "tolerance"]]
    >>> rows.attrs["versions"]
    """
    check()
    from contact_crosscheck.apart import apart
    from reports.exports import load as load_rows

    with apart():
        return load_rows(folder, run, nulls)


def main() -> None:
    """Run the command; exit with 2 and one line if the packages on the path are not ours."""
    try:
        check()
        from reports.command import main as command

        command(prog_name="crosscheck")
    except ForeignPackage as error:
        sys.exit(_refused(str(error)))
    except KeyboardInterrupt:  # also while modules are loaded
        sys.exit(INTERRUPTED)


def pytest_addoption(parser: Any) -> None:
    """Options of pytest (entry point ``pytest11``); without ``--crosscheck`` nothing else of this project is loaded."""
    group = parser.getgroup("crosscheck", "contact scenes as tests (contact-crosscheck)")
    engine = "add a test per check of the contact scenes on ENGINE, which is installed, or FILE.py:CLASS"
    scenes = "of --crosscheck: these scenes (default: all); core: twelve, judged by bound and by order over steps"
    group.addoption("--crosscheck", metavar="ENGINE", help=engine)
    group.addoption("--scenes", metavar="A,B", default="", help=scenes)
    group.addoption("--crosscheck-profile", metavar="P,Q", default="", help="of --crosscheck: these profiles")


def pytest_configure(config: Any) -> None:
    """Load the tests if ``--crosscheck`` is given."""
    if config.getoption("--crosscheck"):
        check()
        from reports import testing

        config.pluginmanager.register(testing.Plugin(config), "contact-crosscheck")


def _refused(line: str) -> int:
    print(line, file=sys.stderr)
    return 2
