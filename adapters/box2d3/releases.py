"""pyb2d3, which carries Box2D 3, over its releases."""

from __future__ import annotations

from adapters.releases import Difference, Distribution, Releases

RELEASES = Releases(
    distributions=(Distribution("pyb2d3"),),
    known=">=0.6.0,<0.12",
    differences=(
        Difference("<0.6.0", "there is no DebugDraw, from which contacts are read", "such a release is not supported",
                   "measured: 0.5.6 has none, 0.6.0 has it"),
    ),
)  # fmt: skip
