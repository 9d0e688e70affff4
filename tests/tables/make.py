"""Makes all tables anew: ``make tables``, or ``python tests/tables/make.py scenes/bounce`` for some.

What changed is said, a line each, so that a change of a bound or a truth is seen before it is kept.
"""

from __future__ import annotations

import sys

from made import tables
from telling import KEPT, as_text, differences, from_text


def main(names: list[str]) -> None:
    """Make those whose names begin so; all by default."""
    makers = tables()
    for name, make in makers.items():
        if names and not name.startswith(tuple(names)):
            continue
        path, found = KEPT / f"{name}.txt", make()
        path.parent.mkdir(parents=True, exist_ok=True)
        before = from_text(path.read_text(encoding="utf-8")) if path.exists() else {}
        changed = differences(found, before)
        if changed or not path.exists():
            path.write_text(as_text(found), encoding="utf-8")
            print(f"{name}: {len(changed)} lines", *changed[:20], sep="\n  ")
    if not names:
        for path in KEPT.rglob("*.txt"):
            if str(path.relative_to(KEPT).with_suffix("")) not in makers:
                path.unlink()
                print(f"{path.name}: nothing makes it any more")


if __name__ == "__main__":
    main(sys.argv[1:])
