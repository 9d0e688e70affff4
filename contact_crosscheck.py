"""The door: ``crosscheck``, ``python -m contact_crosscheck``, and ``from contact_crosscheck import load``.

The packages behind it have plain names (`adapters`, `validation`, `reports`) that other distributions and a user's
own folders may have as well. This module's name is nobody else's: it looks whose packages are on the path before it
hands on, and refuses with one line that names a foreign one and where it lies.
"""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

#: Our packages, in the order in which they may import each other.
PACKAGES = ("reference_solver", "adapters", "validation", "reports")
HOME = Path(__file__).resolve().parent


class ForeignPackage(ImportError):
    """Another package has the name of one of ours and is found first."""


def foreign() -> dict[str, str]:
    """Packages of our names that are not ours, with where they lie; ``nowhere`` for one that is not found."""
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
        One line that names the foreign packages and where they lie.
    """
    wrong = foreign()
    if wrong:
        said = ", ".join(f"{name!r} at {place}" for name, place in wrong.items())
        raise ForeignPackage(
            f"contact-crosscheck: a foreign package hides one of ours: {said}; ours lie in {HOME}. Start from another "
            "folder, or use an environment without that package"
        )


def load(folder: str | Path = "crosscheck-out", run: str = "latest", nulls: bool = False) -> Any:
    """Rows of a run as a DataFrame; see `reports.exports.load`.

    Raises
    ------
    ForeignPackage
        If a package on the path hides one of ours.
    StoreError
        If the folder has no results or no such run.
    """
    check()
    from reports.exports import load as load_rows

    return load_rows(folder, run, nulls)


def main() -> None:
    """Run the command; exits with 2 and one line if the packages on the path are not ours."""
    try:
        check()
    except ForeignPackage as error:
        sys.exit(_refused(str(error)))
    from reports.command import main as command

    command(prog_name="crosscheck")


def pytest_addoption(parser: Any) -> None:
    """Options of pytest (entry point ``pytest11``); without ``--crosscheck`` nothing else of this project is loaded."""
    group = parser.getgroup("crosscheck", "contact scenes as tests (contact-crosscheck)")
    group.addoption("--crosscheck", metavar="ENGINE", help="add a test per check of the contact scenes on ENGINE")
    group.addoption("--scenes", metavar="A,B", default="", help="of --crosscheck: these scenes (default: all)")
    group.addoption("--crosscheck-profile", metavar="P,Q", default="", help="of --crosscheck: these profiles")


def pytest_configure(config: Any) -> None:
    """Load the tests if they are asked for."""
    if config.getoption("--crosscheck"):
        check()
        from reports import testing

        config.pluginmanager.register(testing.Plugin(config), "contact-crosscheck")


def _refused(line: str) -> int:
    print(line, file=sys.stderr)
    return 2


if __name__ == "__main__":
    main()
