"""The report in a real browser, offline: no request, no error, complete without JavaScript, usable by keyboard."""

import csv
import re
from contextlib import contextmanager
from pathlib import Path

import pytest

from reports.wording import reproduce

WIDTHS = {"phone": 390, "laptop": 1280, "wide": 1920}


@contextmanager
def opened(browser, file, anchor="", width=1280, **options):
    """A page that must cause no request, console message, error or policy violation until it is closed."""
    context = browser.new_context(viewport={"width": width, "height": 800}, offline=True, **options)
    page, wrong = context.new_page(), []
    page.on("console", lambda message: wrong.append(f"console {message.type}: {message.text}"))
    page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    page.on("request", lambda request: wrong.append(f"request: {request.url[:80]}"))
    url = file.as_uri() + anchor
    page.goto(url)
    page.wait_for_load_state("networkidle")
    allowed = f"request: {file.as_uri()[:80]}"
    yield page
    context.close()
    assert [entry for entry in wrong if not entry.startswith(allowed) and "data:" not in entry] == []


def until(page, condition):
    """Wait for a condition; the page's policy forbids the evaluation that Playwright's own waiting needs."""
    for _ in range(200):
        if page.evaluate(f"() => {condition}"):
            return
        page.wait_for_timeout(50)
    raise AssertionError(condition)


def test_page_without_requests_or_console_errors(browser, page_file):
    with opened(browser, page_file) as page:
        for summary in page.locator("summary").all():
            summary.evaluate("node => node.parentElement.open = true")
        assert page.title().startswith("contact-crosscheck")


def test_the_policy_stops_a_script_that_is_injected(browser, page_file):
    context = browser.new_context(offline=True)
    page = context.new_page()
    page.goto(page_file.as_uri())
    page.evaluate(
        "() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 3';"
        "document.body.append(s); const b = document.createElement('b');"
        "b.setAttribute('onclick', 'window.hacked = 4'); document.body.append(b); b.click(); }"
    )
    assert page.evaluate("window.hacked") is None
    context.close()


def test_scene_named_like_a_script(browser, page_file):
    with opened(browser, page_file) as page:
        assert page.evaluate("window.hacked") is None
        assert page.locator("img").count() == 0
        assert "<script>window.hacked=1</script>" in page.locator("main").inner_text()


def test_without_javascript_verdicts_plots_and_tables_are_there(browser, page_file):
    with opened(browser, page_file, java_script_enabled=False) as page:
        assert page.locator(".matrix.overall tbody tr").count() >= 3
        assert "pass" in page.locator(".matrix.overall").inner_text()
        page.locator("details.scene", has=page.locator("#scene-impact")).locator("summary").first.click()
        plots = page.locator("#scene-impact figure.plot svg")
        assert plots.count() >= 2
        assert plots.first.bounding_box()["height"] > 100
        assert page.locator("#explorer-still svg").bounding_box()["height"] > 100
        assert page.locator("a[download='rows.json.gz']").get_attribute("href").startswith("data:application/gzip")
        for id in ("player", "explorer-live"):
            assert not page.locator(f"#{id}").is_visible()
        assert page.locator("button:visible").count() == 0  # a button without JavaScript would do nothing
        for lacks in ("Without JavaScript this page lacks", "The player needs JavaScript", "The slider needs"):
            # Looking for text passes over what is inside `noscript`.
            assert any(text.startswith(lacks) for text in page.locator("noscript p:visible").all_inner_texts()), lacks


def test_every_link_of_the_page_leads_somewhere(browser, page_file):
    with opened(browser, page_file) as page:
        dead = page.evaluate(
            "() => [...document.querySelectorAll(\"a[href^='#']\")].map(a => a.getAttribute('href').slice(1))"
            ".filter(id => !document.getElementById(id))"
        )
        assert dead == []
        assert page.evaluate("() => { const ids = [...document.querySelectorAll('[id]')].map(e => e.id);"
                             "return ids.filter((id, k) => ids.indexOf(id) !== k); }") == []  # fmt: skip


def test_link_from_matrix_field_to_row_and_opened_check(browser, page_file):
    with opened(browser, page_file) as page:
        page.locator(".matrix.overall a.h", has_text="known").first.click()
        page.locator("div:target .matrix a.h", has_text="known").first.click()
        row = page.locator("tr:target")
        assert row.is_visible() and "✗" in row.inner_text()
        page.locator(".overview", has=row).locator("thead a").first.click()
        assert page.locator("details:target").evaluate("node => node.open")


def test_what_a_link_leads_to_opens_without_javascript(browser, page_file):
    for anchor in ("#family-friction", "#incline-2", "#impact-2"):
        with opened(browser, page_file, anchor, java_script_enabled=False) as page:
            assert page.locator(anchor).is_visible()


@pytest.mark.usefixtures("bullet")
def test_reason_and_cure_in_the_findings(browser, page_file):
    with opened(browser, page_file, "#bounce-2") as page:
        page.locator("#bounce-2 details.check").first.evaluate("node => node.open = true")
        page.locator("#bounce-2 .worst li", has_text="bullet/default").first.locator("a").click()
        target = page.locator("tr:target")
        assert target.is_visible() and "bullet/default" in target.inner_text() and "tuned" in target.inner_text()


def picture(page):
    return page.locator("#replay-canvas").evaluate("node => node.toDataURL()")


@pytest.mark.usefixtures("bullet")
def test_replay_controls_by_mouse_and_keyboard(browser, page_file):
    with opened(browser, page_file, "#replay") as page:
        page.locator("#player").wait_for(state="visible")
        until(page, "document.getElementById('replay-series').querySelectorAll('label').length > 0")
        page.select_option("#replay-scene", "replay-bounce-2")
        until(page, "document.getElementById('replay-time').max > 100")
        start = picture(page)
        canvas, time = page.locator("#replay-canvas"), page.locator("#replay-time")
        canvas.focus()
        for _ in range(40):
            page.keyboard.press("ArrowRight")
        assert time.input_value() == "40"
        assert picture(page) != start
        page.keyboard.press("Home")
        assert time.input_value() == "0" and picture(page) == start
        page.keyboard.press("End")
        assert time.input_value() == time.get_attribute("max")
        page.keyboard.press("Home")
        page.keyboard.press("Space")
        until(page, "document.getElementById('replay-time').value > 0")
        page.keyboard.press("Space")
        assert page.locator("#replay-play").inner_text() == "Play"
        page.locator("#replay-jumps button", has_text="bullet/default").click()
        departed = float(re.search(r"at ([\d.]+) s", page.locator("#replay-jumps button").first.inner_text())[1])
        assert float(page.locator("#replay-clock").inner_text().split()[0]) == pytest.approx(departed, abs=1 / 60)
        here = picture(page)
        page.select_option("#replay-magnify", "10")
        assert picture(page) != here
        page.select_option("#replay-magnify", "1")
        page.locator("#replay-series input").nth(2).click()
        assert picture(page) != here
        box = time.bounding_box()
        page.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + 0.5 * box["height"])
        share = float(time.input_value()) / float(time.get_attribute("max"))
        assert share == pytest.approx(0.75, abs=0.05)


@pytest.mark.usefixtures("bullet")
def test_both_layouts_show_every_engine(browser, page_file):
    with opened(browser, page_file, "#replay") as page:
        until(page, "document.getElementById('replay-series').querySelectorAll('label').length > 0")
        pictures = []
        for layout in ("over", "beside"):
            page.select_option("#replay-layout", layout)
            pictures.append(picture(page))
        assert pictures[0] != pictures[1]
        assert page.locator("#replay-series label").count() == 4


@pytest.mark.parametrize("layout", ["over", "beside"])
def test_replay_drawn_at_every_width_and_while_hidden(browser, page_file, layout):
    with opened(browser, page_file, "#replay") as page:
        until(page, "document.getElementById('replay-series').querySelectorAll('label').length > 0")
        page.select_option("#replay-layout", layout)
        scenes = page.locator("#replay-scene option").evaluate_all("nodes => nodes.map(node => node.value)")
        for width in (320, 160, 120, 60, 40):
            page.set_viewport_size({"width": width, "height": 60 if width < 100 else 800})
            for scene in scenes:
                page.select_option("#replay-scene", scene)
                until(page, "document.getElementById('replay-time').max > 1")
                page.locator("#replay-time").fill("3")
        page.evaluate("document.getElementById('player').hidden = true; dispatchEvent(new Event('resize'))")


#: Heights of the topmost marks in columns of the replay, from the top, as shares of the canvas.
TOPMOST = (
    "shares => { const c = document.getElementById('replay-canvas'), w = c.width, h = c.height;"
    "const all = c.getContext('2d').getImageData(0, 0, w, h).data;"
    "return shares.map((share) => { const x = Math.round(share * (w - 1));"
    "for (let y = 0; y < h; y++) if (all[4 * (y * w + x) + 3] > 40) return y / h; return -1; }); }"
)


@pytest.mark.parametrize(("scene", "falls"), [("impact", False), ("incline", True)])
def test_picture_of_an_incline(browser, page_file, scene, falls):
    """The scene is posed with its floor level and gravity aslant; beside the bodies the floor alone is drawn."""
    with opened(browser, page_file, "#replay") as page:
        page.select_option("#replay-scene", f"replay-{scene}-2")
        page.select_option("#replay-layout", "over")
        page.locator("#replay-time").press("Home")
        left, right = page.evaluate(TOPMOST, [0.05, 0.25])
        assert left > 0.0 and right > 0.0
        assert (right - left > 0.1) if falls else (abs(right - left) < 0.01)


@pytest.mark.usefixtures("bullet")
def test_names_of_lanes(browser, page_file):
    """On a phone lanes stand in several rows: the name of each must fit beside its square."""
    with opened(browser, page_file, "#replay", width=320) as page:
        until(page, "document.getElementById('replay-series').querySelectorAll('label').length > 0")
        found = page.evaluate(
            "() => { const seen = [], pen = CanvasRenderingContext2D.prototype, rect = pen.rect, text = pen.fillText;"
            "let lane = 0;"
            "pen.rect = function (x, y, w, h) { lane = w; return rect.call(this, x, y, w, h); };"
            "pen.fillText = function (said, x, y) { seen.push([said, x + this.measureText(said).width, lane]);"
            "return text.call(this, said, x, y); };"
            "const layout = document.getElementById('replay-layout'); layout.value = 'beside';"
            "layout.dispatchEvent(new Event('change')); return seen; }"
        )
    assert {"chipmunk", "bullet", "default", "tuned"} <= {said for said, *_ in found}
    assert [entry for entry in found if entry[1] > entry[2]] == []


@pytest.mark.usefixtures("bullet")
def test_a_spatial_replay_offers_three_views(browser, page_file):
    with opened(browser, page_file, "#replay") as page:
        until(page, "document.getElementById('replay-series').querySelectorAll('label').length > 0")
        assert not page.locator("#replay-plane").is_visible()
        page.select_option("#replay-scene", "replay-impact-3")
        page.locator("#replay-plane").wait_for(state="visible")
        front = picture(page)
        page.select_option("#replay-plane", "xy")
        assert picture(page) != front


@pytest.mark.parametrize("width", [1200, 420])
def test_labels_of_the_explorer_beside_its_markers(browser, page_file, width):
    with opened(browser, page_file, "#explorer") as page:
        page.set_viewport_size({"width": width, "height": 800})
        page.locator(".preset[data-e='0.8']").click()
        told = page.locator("#explorer-plot .halo").all_text_contents()
        labels, markers = ([each.bounding_box() for each in page.locator(where).all()]
                           for where in ("#explorer-plot .halo", "#explorer-plot path[role]"))  # fmt: skip
    assert "e = 0.8" in told and markers
    apart = [
        any(a[x] + a[size] <= b[x] or b[x] + b[size] <= a[x] for x, size in (("x", "width"), ("y", "height")))
        for a in labels for b in markers
    ]  # fmt: skip
    assert all(apart)


def test_the_explorer_follows_its_slider_and_its_presets(browser, page_file):
    with opened(browser, page_file, "#explorer") as page:
        curve = page.locator("#explorer-plot polyline").last
        before = curve.get_attribute("points")
        points = page.locator("#explorer-plot path[role]").count()
        assert points > 0
        page.locator("#explorer-e").focus()
        page.keyboard.press("ArrowLeft")
        assert page.locator("#explorer-value").inner_text() == "0.79"
        assert page.locator("#explorer-plot polyline").last.get_attribute("points") != before
        page.locator("button.preset", has_text="clay").click()
        assert page.locator("#explorer-value").inner_text() == "0.00"
        assert "does not rise" in page.locator("#explorer-says").inner_text()
        page.locator("button.preset", has_text="rubber").click()
        assert page.locator("#explorer-plot polyline").last.get_attribute("points") == before
        linear = page.locator("#explorer-plot").inner_html()
        page.locator("#explorer-log").check()
        assert page.locator("#explorer-plot").inner_html() != linear


@pytest.mark.usefixtures("bullet")
def test_switched_off_engine_in_the_address(browser, page_file):
    who, other = "bullet/default", "bullet/tuned"
    charts, rows = f".canvas [data-who='{who}']", f"#impact-2 tr[data-who='{who}']"

    def gone(page):
        until(page, f"document.querySelectorAll(\"[data-who='{who}']\").length > 0")
        for selector in (".matrix.overall", "#scene-impact"):
            page.locator(selector).first.wait_for()
        assert page.locator(f"[data-who='{who}']:visible").count() == 0
        assert page.locator(f".matrix.overall [data-who='{other}']:visible").count() > 2
        assert page.locator(f"#explorer-plot path[aria-label^='{who}']").count() == 0
        assert page.locator(f"#explorer-plot path[aria-label^='{other}']").count() > 0

    with opened(browser, page_file, "#scene-impact") as page:
        assert page.locator(charts).count() > 0 and page.locator(rows).count() > 0
        assert page.locator(f".matrix.overall [data-who='{who}']:visible").count() > 2
        page.locator(f"#filter input[value='{who}']").uncheck()
        gone(page)
        kept = "#" + page.url.partition("#")[2]
    assert kept.startswith("#scene-impact?") and "hide=" in kept
    with opened(browser, page_file, kept) as page:
        assert not page.locator(f"#filter input[value='{who}']").is_checked()
        gone(page)
        page.locator("#filter-all").click()
        assert page.locator(f".matrix.overall [data-who='{who}']:visible").count() > 2
        assert "hide=" not in page.url


def test_a_chart_point_says_what_it_is(browser, page_file):
    with opened(browser, page_file, "#scene-impact") as page:
        point = page.locator("#fig-work-impact-2 [data-is*='per simulated second']").first
        point.hover()
        hint = page.locator("#hint")
        assert hint.is_visible()
        assert "dt 1/" in hint.inner_text() and "error" in hint.inner_text()
        page.keyboard.press("Escape")
        assert not hint.is_visible()


@pytest.mark.parametrize("kind", ["CSV", "SVG", "PNG"])
def test_tables_and_plots_can_be_saved(browser, page_file, kind):
    selector = "#choose button.save" if kind == "CSV" else f"#scene-impact button.save:has-text('{kind}')"
    with opened(browser, page_file, "#impact-2") as page:
        with page.expect_download() as found:
            page.locator(selector).first.click()
        content = Path(found.value.path()).read_bytes()
    heads = {"CSV": b"scene,", "SVG": b"<svg ", "PNG": b"\x89PNG"}
    assert content.startswith(heads[kind])


@pytest.mark.usefixtures("bullet")
def test_headings_of_groups_in_a_saved_table(browser, page_file):
    with opened(browser, page_file, "#forces") as page:
        with page.expect_download() as found:
            page.locator("#forces-bullet ~ button.save").first.click()
        heads, *lines = csv.reader(Path(found.value.path()).read_text().splitlines())
    assert heads[:2] == ["group", "profile"] and {len(line) for line in lines} == {len(heads)}
    calls = {line[0] for line in lines}
    assert len(calls) > 1 and all("getContactPoints" in call for call in calls)


@pytest.mark.usefixtures("bullet")
def test_title_and_legend_of_a_saved_picture(browser, page_file):
    with opened(browser, page_file, "#impact-2") as page:
        figure = page.locator("#scene-impact figure.plot").first
        title = figure.locator("svg").get_attribute("aria-label")
        with page.expect_download() as found:
            figure.locator("button.save:has-text('SVG')").click()
        with page.expect_download() as talk:
            page.locator(".talk button.save:has-text('SVG')").click()
        saved, picture = (Path(each.value.path()).read_text() for each in (found, talk))
    words = re.findall(r"<text[^>]*>([^<]*)</text>", saved)
    assert title in words and {"bullet/default", "bullet/tuned"} <= set(words)
    low, high = (float(v) for v in re.search(r'viewBox="\S+ (\S+) \S+ (\S+)"', saved).groups())
    heights = [float(y) for y in re.findall(r'<text x="[^"]*" y="([^"]*)" fill', saved)]
    assert len(heights) >= 3 and all(low < y < low + high for y in heights), "what is said lies in the picture"
    assert "Restitution that was set and measured" in picture and "bullet/default</text>" not in picture
    # Every name stands beside its mark, and ends before the next one or the edge; names of three fixed columns did not.
    key = [
        (float(x), float(y), text)
        for x, y, text in re.findall(
            r'<text x="([^"]*)" y="([^"]*)" fill="[^"]*" font-size="12" font-weight="400"[^>]*>([^<]*)<', saved
        )
    ]
    left, across = (float(v) for v in re.search(r'viewBox="(\S+) \S+ (\S+) \S+"', saved).groups())
    for x, y, text in key:
        assert f'transform="translate({x - 10:g},{y - 4:g})"' in saved, text
        right = min([left + across, *(other for other, line, _ in key if line == y and other > x)])
        assert x + 6.2 * len(text) < right, text


def test_csv_with_every_digit_and_no_formula(browser, page_file, page_source):
    with opened(browser, page_file, "#tables") as page:
        with page.expect_download() as found:
            page.locator("#as-csv button").click()
        rows = list(csv.DictReader(Path(found.value.path()).read_text().splitlines()))
    assert len(rows) == len(page_source.rows)
    values = [None if row["value"] == "" else float(row["value"]) for row in rows]
    assert values == [row["value"] for row in page_source.rows]
    assert [row["because"] for row in rows] == [row["because"] for row in page_source.rows]


def test_commands_in_a_table_of_errors(browser, page_file, page_source):
    """Each line holds only what its command does not share with the others of its table."""
    with opened(browser, page_file, "#impact-2") as page:
        page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
        said = []
        for line in range(3):
            # Told to the field itself: parts that have just been opened still move what a pointer would hit.
            field = page.locator("#impact-2 .grid").first.locator("tbody tr").nth(line).locator("td").nth(2)
            field.dispatch_event("click")
            said.append(page.locator("#hint").inner_text().removeprefix("copied: "))
    rows = [r for r in page_source.rows if (r["scene"], r["dimension"]) == ("impact", 2) and r["outcome"] == "ok"]
    wanted = dict.fromkeys(reproduce(r["slot"]) for r in rows if (r["engine"], r["profile"]) == ("chipmunk", "default"))
    assert said == list(wanted)[:3]


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_no_width_scrolls_sideways(browser, page_file, width):
    with opened(browser, page_file, width=width) as page:
        page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_width_of_captions(browser, page_file, width):
    with opened(browser, page_file, width=width) as page:
        page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
        said = page.evaluate(
            "() => [...document.querySelectorAll('caption span')].map(node => [node.textContent.slice(0, 40),"
            "node.getBoundingClientRect().right - node.closest('.scroll').getBoundingClientRect().right])"
        )
    assert len(said) > 5
    assert [entry for entry in said if entry[1] > 1] == []


@pytest.mark.parametrize("width", [390, 1000, 1200])
def test_width_of_the_table_of_what_is_wrong(browser, page_file, width):
    """It was 1210 px wide in a box of 1160 px."""
    with opened(browser, page_file, width=width) as page:
        page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
        # Wide words of other runs: a scene's name, a setting, a value with its unit and its truth.
        page.evaluate(
            "document.querySelectorAll('.wrongs tbody tr').forEach(row => {"
            "row.cells[0].append(' restitution_above_one 2-D and 3-D'); const set = row.cells[3];"
            "set.append(document.createElement('code')); set.lastChild.textContent = 'contactProcessingThreshold=0';"
            "if (row.cells[5]) row.cells[5].textContent = '-0.00406\u00a0rad/s (true: -0.0233)'; })"
        )
        over = page.evaluate(
            "() => [...document.querySelectorAll('.wrongs')].map(t => t.offsetWidth - t.parentElement.clientWidth)"
        )
    assert over and max(over) <= 0


def test_lines_of_tables_on_a_phone(browser, page_file):
    """What lies outside the picture makes no line taller than a screen."""
    with opened(browser, page_file, width=390) as page:
        page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
        tall = page.evaluate(
            "() => [...document.querySelectorAll('.wrongs tr, .findings tr, #own-failures tr')]"
            ".filter(row => row.cells[row.cells.length - 1].getBoundingClientRect().left > 390)"
            ".map(row => row.textContent.slice(0, 60))"
        )
    assert tall == []


def test_text_of_the_explorer_on_a_phone(browser, page_file):
    with opened(browser, page_file, "#explorer", width=390) as page:
        height = page.locator("#explorer-plot text").first.evaluate("node => node.getBoundingClientRect().height")
    assert height > 10


@pytest.mark.parametrize("width", [390, 1280])
def test_headline_picture_and_matrix_before_filter_and_facts(browser, page_file, page_source, width):
    parts = ("h1", ".talk svg", ".matrix.overall", ".families", "#filter", ".facts")
    with opened(browser, page_file, width=width) as page:
        boxes = [page.locator(f"#verdicts {part}").first.bounding_box() for part in parts]
        hinted = page.locator(".swipe:visible").count() == 1
    places = [box["y"] for box in boxes]
    if width == 390:
        assert places == sorted(places) and hinted is (len(page_source.engines) > 2)
    else:
        assert places[3:] == sorted(places[3:]) and max(places[:3]) < min(places[3:]) and not hinted
        assert boxes[1]["x"] + boxes[1]["width"] <= boxes[2]["x"], "picture and matrix stand side by side"
        assert boxes[2]["y"] + boxes[2]["height"] < 800, "on the first screen"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_issue(browser, page_file, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install axe-playwright-python").Axe()
    context = browser.new_context(viewport={"width": 1280, "height": 800}, offline=True, color_scheme=scheme)
    page = context.new_page()
    page.goto(page_file.as_uri())
    page.evaluate("document.querySelectorAll('details').forEach(node => node.open = true)")
    found = axe.run(page).response["violations"]
    context.close()
    serious = [
        (issue["id"], node["target"], node.get("failureSummary"))
        for issue in found if issue["impact"] in ("serious", "critical") for node in issue["nodes"][:3]
    ]  # fmt: skip
    assert serious == []


def test_light_and_dark_swap_paper_and_ink(browser, page_file):
    seen = {}
    for scheme in ("light", "dark"):
        with opened(browser, page_file, color_scheme=scheme) as page:
            style = page.evaluate(
                "() => { const s = getComputedStyle(document.body); return [s.backgroundColor, s.color]; }"
            )
            seen[scheme] = [sum(map(int, re.findall(r"\d+", colour)[:3])) for colour in style]
    assert seen["light"][0] > seen["light"][1]
    assert seen["dark"][0] < seen["dark"][1]
