"""Makes all kept texts anew: ``make tables``, or ``python tests/tables/make.py scenes/bounce`` for some.

What changed is said, a line each, so that a change of a bound or a truth is seen before it is kept.
"""

from __future__ import annotations

import sys

from made import tables
from screens import SCREENS
from telling import KEPT, as_text, differences, from_text, screen_differences


def main(names: list[str]) -> None:
    """Make those whose names begin so; all by default."""
    makers, kept = tables(), set[str]()
    for name, make in (makers | SCREENS).items():
        kept.add(name)
        if names and not name.startswith(tuple(names)):
            continue
        path, made = KEPT / f"{name}.txt", make()
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        if isinstance(made, str):
            text, changed = made, screen_differences(made, before)
        else:
            text, changed = as_text(made), differences(made, from_text(before))
        if changed:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            print(f"{name}: {len(changed)} lines", *changed[:20], sep="\n  ")
    if not names:
        for path in KEPT.rglob("*.txt"):
            if str(path.relative_to(KEPT).with_suffix("")) not in kept:
                path.unlink()
                print(f"{path.name}: nothing makes it any more")


if __name__ == "__main__":
    main(sys.argv[1:])
