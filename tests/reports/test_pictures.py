"""Pictures of a report: what is asked of the browser, in which order, and what is written into each picture."""

import io
import sys
from types import ModuleType, SimpleNamespace
from unittest.mock import MagicMock

import pytest
from PIL import Image

from reports import pictures

_DRAWN = io.BytesIO()
Image.new("RGB", (3, 2), (10, 200, 30)).save(_DRAWN, "PNG")
#: A picture of six points.
PNG = _DRAWN.getvalue()


@pytest.fixture
def browser(monkeypatch):
    """A browser that writes the same picture wherever it is asked for one."""
    page = MagicMock()
    page.locator.return_value.inner_text.return_value = "run 1, commit c0ffee"

    def screenshot(path):
        path.write_bytes(PNG)

    page.locator.return_value.first.screenshot.side_effect = screenshot
    page.locator.return_value.screenshot.side_effect = screenshot
    found = MagicMock()
    found.new_context.return_value.new_page.return_value = page
    opened = MagicMock()
    opened.return_value.__enter__.return_value.chromium.launch.return_value = found
    module = ModuleType("playwright.sync_api")
    module.sync_playwright = opened
    monkeypatch.setitem(sys.modules, "playwright.sync_api", module)
    return SimpleNamespace(page=page, found=found, opened=opened)


def test_pictures_in_light_and_dark_without_a_network(browser, tmp_path):
    report = tmp_path / "report.html"
    pictures.main(str(report), str(tmp_path / "new" / "folder"))
    taken = sorted(path.name for path in (tmp_path / "new" / "folder").iterdir())
    assert taken == sorted(
        f"{name}-{scheme}.png" for name in (*pictures.SHOTS, "replay") for scheme in pictures.SCHEMES
    )
    asked = [call.kwargs for call in browser.found.new_context.call_args_list]
    size = {"width": 1280, "height": 860}
    assert asked == [{"viewport": size, "color_scheme": scheme, "offline": True, "bypass_csp": True}
                     for scheme in ("light", "dark")]  # fmt: skip
    assert [call.args for call in browser.page.goto.call_args_list] == [(report.as_uri(),)] * 2
    assert [call.kwargs for call in browser.page.add_style_tag.call_args_list] == [{"content": pictures.STYLE}] * 2
    wanted = [*pictures.SHOTS.values(), "#replay-time", "#replay-canvas", "footer"]
    assert [call.args[0] for call in browser.page.locator.call_args_list] == wanted * 2
    assert [call.args for call in browser.page.select_option.call_args_list[:2]] == [
        ("#replay-scene", "replay-bounce-2"), ("#replay-layout", "beside")]  # fmt: skip
    browser.page.locator.return_value.fill.assert_called_with("34")
    assert browser.found.new_context.return_value.close.call_count == 2
    browser.found.close.assert_called_once_with()
    for name in taken:
        with Image.open(tmp_path / "new" / "folder" / name) as found:
            assert found.text == {"Source": "run 1, commit c0ffee"} and found.size == (3, 2)
