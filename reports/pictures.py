"""Pictures of a report for the README, taken in a real browser: ``python -m reports.pictures REPORT FOLDER``.

Needs Playwright and a Chromium, like the browser tests; nothing else of the project imports this module.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any, Literal

#: Picture -> the part of the page that it shows.
SHOTS = {"verdicts": "#verdicts", "restitution": "#explorer .plots", "cost": "#speed .plots"}
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
                viewport={"width": WIDTH, "height": HEIGHT}, color_scheme=scheme, offline=True
            )
            page = context.new_page()
            page.goto(Path(report).resolve().as_uri())
            for name, part in SHOTS.items():
                page.locator(part).first.screenshot(path=target / f"{name}-{scheme}.png")
            _replay(page, target / f"replay-{scheme}.png")
            context.close()
        browser.close()


def _replay(page: Any, path: Path) -> None:
    """The bouncing ball of every engine side by side, shortly after the first impact."""
    page.select_option("#replay-scene", "replay-bounce-2")
    page.select_option("#replay-layout", "beside")
    page.wait_for_timeout(300)
    page.locator("#replay-time").fill("34")
    page.locator("#replay-canvas").screenshot(path=path)


if __name__ == "__main__":
    main(*sys.argv[1:3])
