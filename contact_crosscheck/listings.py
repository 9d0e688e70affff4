"""Available engines and scenes as tables."""

from __future__ import annotations

import pandas as pd

from contact_crosscheck.apart import apart
from reports import listing, numbers


def engines() -> pd.DataFrame:
    """List all engines.

    Returns
    -------
    pandas.DataFrame
        One row for each engine: ``name``, ``version``, ``status``, ``profiles`` (list of names), ``reason`` if it is
        not available; then what is kept of it as shipped, in words: ``cone``, ``combined_friction``, ``threshold`` and
        the others of `reports.numbers.COLUMNS`.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> found = cc.engines()
    >>> found[found.status == "installed"][["name", "version", "profiles"]]
    """
    with apart():
        return pd.DataFrame([told | numbers.of_engine(told["name"]) for told in listing.engines()])


def scenes() -> pd.DataFrame:
    """List all scenes of the catalogue.

    Returns
    -------
    pandas.DataFrame
        One row for each scene: ``name``, ``version``, ``title``, ``dimensions`` (list), ``law`` that gives the truth.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> cc.scenes().set_index("name").loc["bounce"].law
    """
    return pd.DataFrame(listing.scenes())
