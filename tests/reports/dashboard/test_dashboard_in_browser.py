"""The dashboard in a real browser, offline: no request, no error, complete without JavaScript, usable on a phone."""

from contextlib import contextmanager

import pytest

WIDTHS = {"phone": 390, "laptop": 1280}


@contextmanager
def opened(browser, file, anchor="", width=1280, **options):
    """A page that must cause no request, console message or error until it is closed."""
    context = browser.new_context(viewport={"width": width, "height": 800}, offline=True, **options)
    page, wrong = context.new_page(), []
    page.on("console", lambda message: wrong.append(f"console {message.type}: {message.text}"))
    page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    page.on("request", lambda request: wrong.append(f"request: {request.url[:80]}"))
    page.goto(file.as_uri() + anchor)
    page.wait_for_load_state("networkidle")
    yield page
    context.close()
    allowed = f"request: {file.as_uri()[:80]}"
    assert [entry for entry in wrong if not entry.startswith(allowed)] == []


def test_marks_of_four_planted_steps(browser, dashboard_file, planted):
    with opened(browser, dashboard_file) as page:
        assert page.locator(".panel").count() == 4
        assert page.locator(".panel .step").count() == len(planted) == page.locator("#moved tbody tr").count()
        for (engine, profile), kind, _, _ in planted:
            said = page.locator(f"#runs-{engine}-{profile}-impact-2 .events").inner_text()
            assert f"{kind}:" in said
        assert page.locator("#runs-bullet-tuned-impact-2 .step.worse").count() == 1
        assert page.locator("#runs-chipmunk-default-impact-2 .step.better").count() == 1
        assert page.locator("#runs-chipmunk-tuned-impact-2 .step").count() == 0


def test_without_javascript_everything_is_there_but_the_filter(browser, dashboard_file):
    with opened(browser, dashboard_file, java_script_enabled=False) as page:
        assert page.locator(".panel svg polyline").count() >= 8  # errors and times
        assert page.locator("#moved tbody tr").count() == 4
        assert not page.locator("#filter").is_visible()


def test_filters_kept_in_the_address(browser, dashboard_file):
    with opened(browser, dashboard_file) as page:
        page.select_option("select[name=engine]", "bullet")
        assert page.locator(".panel:visible").count() == 2
        assert page.locator("#moved tbody tr:visible").count() == 2
        page.select_option("select[name=verdict]", "moved")
        assert page.locator("#shown").inner_text() == "2 series"
        address = page.url
    assert "engine=bullet" in address and "verdict=moved" in address
    with opened(browser, dashboard_file, "#" + address.partition("#")[2]) as page:
        assert page.locator(".panel:visible").count() == 2
        assert page.locator("select[name=engine]").input_value() == "bullet"
        page.select_option("select[name=engine]", "")
        assert page.locator(".panel:visible").count() == 3  # of four, one has not moved


def test_a_link_to_a_panel_shows_it(browser, dashboard_file):
    with opened(browser, dashboard_file, "#runs-bullet-default-impact-2") as page:
        box = page.locator("#runs-bullet-default-impact-2").bounding_box()
        assert box is not None and 0 <= box["y"] < 800


def test_every_link_leads_somewhere(browser, dashboard_file):
    with opened(browser, dashboard_file) as page:
        for link in page.locator("a[href^='#']").all():
            target = link.get_attribute("href")[1:]
            assert page.locator(f"[id='{target}']").count() == 1, target


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_no_width_makes_the_page_scroll_sideways(browser, dashboard_file, width):
    with opened(browser, dashboard_file, width=width) as page:
        assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessibility_audit_without_findings(browser, dashboard_file, scheme):
    from axe_playwright_python.sync_playwright import Axe

    with opened(browser, dashboard_file, color_scheme=scheme, bypass_csp=True) as page:
        found = Axe().run(page).response["violations"]
        assert [(each["id"], each["nodes"][0]["html"][:200]) for each in found] == []


def test_markup_in_a_name_shown_as_text(browser, tmp_path):
    from reports.brief import Summary
    from reports.dashboard import render
    from reports.dashboard.series import _divided, _Entry

    evil = "<img src=x onerror=window.hacked=1>"
    entries = [
        _Entry(evil, evil, "r", Summary({(evil, evil, "impact", 2): {"a": (0.1 * (1 + k), 0, 1, 0)}}, {evil: evil}))
        for k in range(2)
    ]
    path = tmp_path / "evil.html"
    path.write_text(render(_divided(entries, "runs"), evil), encoding="utf-8")
    with opened(browser, path) as page:
        assert page.locator("img").count() == 0 and page.evaluate("window.hacked") is None
        assert page.locator(".panel").count() == 1
