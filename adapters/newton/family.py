"""What the engines of Newton share: they step one model, each with its own solver."""

from __future__ import annotations

from pathlib import Path

from adapters.checked_engine import CheckedEngine
from adapters.engine import EngineFacts, Scheme
from adapters.newton.simulation import imported
from adapters.scene import Scene
from adapters.scene.means import no_means

#: Facts of all of them; each has its own name, title, scheme and usual step.
FACTS = EngineFacts(
    name="newton",
    title="Newton",
    package="newton",
    dimensions=frozenset({3}),
    scheme=Scheme("detect, solve", 1),
    customary_dt=1.0 / 600.0,
    precision="single",
    apart=True,
    abilities=frozenset({"moving half-space", "course", "capsule", "hull"}),
)


class NewtonFamily(CheckedEngine):
    """What the engines of this package share: Warp's kernels, and what no values of bodies give."""

    module = "newton"

    def version(self) -> str:
        """Version of the installed distribution."""
        imported()  # without the output of its first import
        return super().version()

    def kernels(self) -> Path | None:
        """Folder of this release in Warp's own cache, which holds what is compiled; None if it cannot be written."""
        folder = Path(imported()[0].config.kernel_cache_dir) / f"newton-{self.version()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            return None
        return folder

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse values beyond single precision, and pairs that no body values give."""
        return no_means(scene) or super().refuses(scene, profile)
