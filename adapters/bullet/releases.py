"""PyBullet over its releases."""

from __future__ import annotations

from adapters.releases import Distribution, Releases, Requirement

RELEASES = Releases(
    distributions=(Distribution("pybullet"),),
    known=">=3.2.6,<4",
    requirements=(
        Requirement("<3.2.7", "numpy<2", "its wheels are built against numpy 1: arrays of numpy 2 crash it"),
    ),
)
