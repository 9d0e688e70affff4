"""Pictures of a report for the README, taken in a real browser: ``python -m reports.pictures REPORT FOLDER``.

Needs Playwright, Pillow and a Chromium (extra `dev`); nothing else of the project imports this module. Every picture
has the report's last line (run and commit) as a text chunk named ``Source``.
"""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from typing import Any, Literal

from validation.catalogue import CATALOGUE

#: Picture -> the part of the page that it shows.
SHOTS = {"verdicts": "#verdicts", "restitution": "#shot-restitution", "cost": "#shot-cost"}
#: Room around a picture, without anything that can be clicked or that stays in place when the page moves.
STYLE = ".save { display: none } .top { position: static } #verdicts, .shot { padding: 16px }"
WIDTH, HEIGHT = 1280, 860
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")


def main(report: str, folder: str) -> None:
    """Write every picture in light and dark."""
    from playwright.sync_api import sync_playwright

    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        for scheme in SCHEMES:
            context = browser.new_context(
                viewport={"width": WIDTH, "height": HEIGHT}, color_scheme=scheme, offline=True, bypass_csp=True
            )
            page = context.new_page()
            page.goto(Path(report).resolve().as_uri())
            page.add_style_tag(content=STYLE)
            for name, part in SHOTS.items():
                page.locator(part).first.screenshot(path=target / f"{name}-{scheme}.png")
            _replay(page, target / f"replay-{scheme}.png")
            said = page.locator("footer").inner_text()
            for path in target.glob(f"*-{scheme}.png"):
                path.write_bytes(labelled(path.read_bytes(), said))
            context.close()
        browser.close()


def _replay(page: Any, path: Path) -> None:
    """The bouncing ball of every engine side by side, shortly after the first impact."""
    bounced = next(scene.name for scene in CATALOGUE.values() if scene.restitution and scene.restitution.heights)
    page.select_option("#replay-scene", f"replay-{bounced}-2")
    page.select_option("#replay-layout", "beside")
    page.wait_for_timeout(300)
    page.locator("#replay-time").fill("34")
    page.locator("#replay-canvas").screenshot(path=path)


def labelled(png: bytes, text: str) -> bytes:
    """The picture in 256 colours, a third of the size, with a text chunk ``Source``.

    By maximum coverage: the median cut turns thin blue lines grey.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    said, made = PngInfo(), io.BytesIO()
    said.add_text("Source", text)
    Image.open(io.BytesIO(png)).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE).save(
        made, "PNG", pnginfo=said, optimize=True
    )
    return made.getvalue()


if __name__ == "__main__":
    main(*sys.argv[1:3])
