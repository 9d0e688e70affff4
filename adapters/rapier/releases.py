"""rapier3d over its releases."""

from __future__ import annotations

from adapters.releases import Distribution, Releases

RELEASES = Releases(distributions=(Distribution("rapier3d"),), known=">=0.36.0,<0.37")
