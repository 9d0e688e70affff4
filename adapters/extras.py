"""What to install where a package is missing: no registry has this project, so an extra is named by its packages."""

from __future__ import annotations

import shlex
from functools import cache
from importlib.metadata import PackageNotFoundError, requires

#: Distribution whose metadata lists the packages of each extra.
PROJECT = "contact-crosscheck"


@cache
def required() -> tuple[str, ...]:
    """Requirements of this project with those of its extras, from its metadata; read once a process.

    Raises
    ------
    PackageNotFoundError
        If nothing has installed it.
    """
    return tuple(requires(PROJECT) or ())


def packages(extra: str) -> list[str]:
    """Packages of an extra that this system takes, as ``pip`` reads them; none of an extra that there is not.

    None either where nothing can read the metadata: environments of releases have neither it nor `packaging`.
    """
    extra = extra.replace("_", "-")  # as metadata spell it
    try:
        from packaging.requirements import Requirement

        told = [Requirement(line) for line in required() if extra in line]
    except (PackageNotFoundError, ModuleNotFoundError):
        return []
    return sorted(
        f"{each.name}{each.specifier}"
        for each in told
        if each.marker and "extra" in str(each.marker) and each.marker.evaluate({"extra": extra})
    )


def install(extra: str) -> str:
    """Command that installs the packages of an extra; where no metadata lists them, the one for a checkout."""
    return shlex.join(["pip", "install", *(packages(extra) or ["-e", f".[{extra}]"])])
