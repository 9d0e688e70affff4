"""The documentation builds offline without a warning, with a page for each scene."""

import importlib
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from adapters import registry
from reference_solver import Body, Disc, HalfSpace, Model
from reference_solver.certificate.truth import Certificate
from reference_solver.exact.bodies import Bodies, start_of, world_of
from reference_solver.exact.loop import Loop
from reference_solver.exact.motion import Piece
from reference_solver.exact.problem import Answer, Problem
from reference_solver.exact.rows import Rows
from reference_solver.textbook2 import columns
from reports import listing
from reports.wording import number
from validation import bounds
from validation.catalogue import CATALOGUE

ROOT = Path(__file__).parents[1]


def test_verdicts_on_scene_pages(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    found = importlib.import_module("pages").passed()
    # What came after it was published stands in a fragment of the changelog.
    news = " ".join(path.read_text(encoding="utf-8") for path in (ROOT / "changelog.d").glob("*.added*.md"))
    since = {name for name in CATALOGUE if name not in set(found.scene)}
    assert set(found.scene) <= set(CATALOGUE) and all(f"Scene `{name}`" in news for name in since)
    exact = found[(found.engine == "reference") & (found.profile == "reference")]
    assert (exact.judged > 0).all() and (exact.failed == 0).all()
    assert (found.failed > 0).any() and (found.failed <= found.judged).all()


def test_lines_to_paste_for_recommended_fixes(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    fixes = importlib.import_module("pages").fixes
    told = [fix for scene in CATALOGUE for fix in fixes(scene)]
    weak = [fix for fix in told if fix["cure"].helps and not fix["cure"].recommended]
    said = ("the best settings found fix", "breaks more elsewhere than it fixes")
    assert weak and all(any(part in fix["text"] for part in said) and not fix["paste"] for fix in weak)
    assert any(fix["paste"] for fix in told)


@pytest.fixture
def pages(monkeypatch):
    """The module that makes pages of what the project knows."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("pages")


def test_pages_of_engines_that_are_not_installed(monkeypatch):
    """Seven of eleven engines had no page where the documentation was built."""
    monkeypatch.setattr(listing.registry, "listed", lambda name: SimpleNamespace(version="", engine=None, reason="no"))
    for name in registry.names():
        told = listing.describe(name)
        assert told["status"] == "not installed" and told["quirks"] is not None
        assert all(settings for scenes in told["profiles"].values() for settings in scenes.values()), name
        assert set(told["profiles"]) == set(registry.facts(name).roles) | set(registry.adapter(name).profiles)


@pytest.mark.parametrize(
    ("text", "typeset"),
    [
        ("h_n = e^(2n) h0", "h<sub>n</sub> = e<sup>2n</sup> h0"),
        ("v+ = -e v-,  J = m (1 + e) v", "v<sup>+</sup> = -e v<sup>-</sup>, &ensp;J = m (1 + e) v"),
        ("sticks if tan(theta) <= mu", "sticks if tan(θ) ≤ μ"),
        ("w+ = eta w-, v1' = v_(n+1)", "w<sup>+</sup> = η w<sup>-</sup>, v1′ = v<sub>n+1</sub>"),
        ("sqrt(2 h0/g), dimension", "√(2 h0/g), dimension"),
    ],
)
def test_a_typeset_law(pages, text, typeset):
    assert pages.law(text) == typeset


def test_every_shared_tolerance_is_derived_on_its_page(pages):
    told = {entry["name"]: entry for _, entries in pages.tolerances() for entry in entries}
    own = {
        name
        for name, value in vars(bounds).items()
        if inspect.isfunction(value) and value.__module__ == bounds.__name__
    }
    assert {name for name in own if not name.startswith("_")} == set(told) and all(e["text"] for e in told.values())
    assert told["landed"]["because"].startswith("the impact is found up to one step late, v dt deep")
    listed = [check for reason in pages.reasons() for check in reason["checks"]]
    assert len(listed) == len(set(listed)) == sum(len(listing.describe(n)["checks_at_defaults"]) for n in CATALOGUE)


def test_each_cited_work_stands_once_in_the_bibliography(pages):
    found = pages.references()
    works = [work for _, work, _ in found["works"]]
    assert set(found["scenes"]) == set(CATALOGUE) and len(works) == len(set(works)) >= 6
    assert [n for n, _, _ in found["works"]] == list(range(1, len(works) + 1))
    assert any(work.startswith("G. W. Housner") for work in works)
    (number,) = found["scenes"]["rocking_block"]["works"]
    assert works[number - 1].startswith("G. W. Housner") and len(found["scenes"]["painleve"]["works"]) == 2


def test_numbers_of_the_worked_example(pages):
    told = pages.worked.example()
    assert [told[name] for name in ("speed", "after", "apex", "late")] == ["4.43", "3.54", "0.64", "0.0185"]
    checks = pages.worked.results()[told["rows"][0]["who"]].frame().set_index("metric")
    assert told["tolerance"] == number(checks.loc["apex[1]"].tolerance)
    assert {row["verdict"] for row in told["rows"]} == {"PASS", "FAIL"}


def written_by_hand():
    """Every page for people but the theory of the solver and the list of models in `tests/models`."""
    tracked = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, check=True, capture_output=True, text=True)
    apart = ("docs/solver/", "reports/published/", "tests/")
    return [ROOT / name for name in tracked.stdout.split() if not name.startswith(apart)]


def test_word_limit_of_handwritten_pages():
    words = {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").split()) for path in written_by_hand()
    }
    assert {"README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "docs/method.md"} <= set(words)
    assert sum(words.values()) <= 12_000, words


def test_fragments_of_the_changelog_have_a_type_that_towncrier_knows():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["towncrier"]
    types = "|".join(kind["directory"] for kind in settings["type"])
    names = [path.name for path in (ROOT / settings["directory"]).iterdir()]
    known = re.compile(rf"(\d+|\+[\w-]+)\.({types})(\.\d+)?\.md|README\.md")
    assert [name for name in names if not known.fullmatch(name)] == []


def test_every_equation_of_the_solver_is_stated_once():
    """Headings, or the first words of a paragraph in bold; what code and tests cite is among them."""
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "solver").glob("*.md"))]
    stated = [name for text in texts for name in re.findall(r"^(?:#+ |\*\*)([EO]\d+) ", text, re.MULTILINE)]
    assert len(stated) == len(set(stated)) >= 85
    cited = set()
    for folder in ("reference_solver", "adapters/reference", "tests/reference_solver"):
        for path in (ROOT / folder).rglob("*.py"):
            cited |= set(re.findall(r"\b[EO]\d{1,2}\b", path.read_text(encoding="utf-8")))
    assert len(cited) > 45 and cited <= set(stated), cited - set(stated)


def test_snippets_of_the_solver_s_documents_run():
    names = (
        "reference_solver/README.md",
        *(f"docs/solver/{name}.md" for name in ("certificate", "oracle", "verification", "loop", "step")),
    )
    made = {}
    for name in names:
        for snippet in re.findall(
            r"^```py(?:thon)?\n(.*?)^```", (ROOT / name).read_text(encoding="utf-8"), re.M | re.S
        ):
            exec(snippet, made)
    assert made["simulation"].twist[1, 1] == pytest.approx(4.8, abs=1e-12)
    assert made["certificate"].holds and made["oracle"].certificate["events"] == 1
    assert made["verdict"].certified and made["verdict"].answer["third [m/s]"] == pytest.approx(2 / 3)
    assert made["loop"].state.place[1] == pytest.approx((2.29, 0.5), abs=1e-6)
    assert made["state"].place[1] == pytest.approx((2.29, 0.5), abs=1e-6)
    slowing = 0.5 * 9.81 / 240  # in a step: it still moves in 97 of them
    stop = (97 * 2.0 - slowing * 97 * 98 / 2) / 240
    assert made["world"].pose[1] == pytest.approx((stop, 0.5, 0.0), abs=1e-6)


def test_names_in_the_table_of_symbols():
    """Columns of the planar textbook's tables, and fields of classes that the loop and its certificate have."""
    text = (ROOT / "docs" / "solver" / "model.md").read_text(encoding="utf-8")
    named = {name for row in re.findall(r"^\| .*\| (.*) \| .* \|$", text, re.M) for name in re.findall(r"`(.+?)`", row)}
    tables = {name for name in named if name.isupper()}
    assert len(tables) == 18 and all(hasattr(columns, name) for name in tables)
    classes = {each.__name__: each for each in (Piece, Rows, Answer, Bodies, Problem, Certificate)}
    fields = [name.split(".") for name in named if "." in name]
    assert {of for of, _ in fields} == set(classes)
    assert all(field in classes[of].__annotations__ for of, field in fields)


def listings_of_the_loop():
    text = (ROOT / "docs" / "solver" / "loop.md").read_text(encoding="utf-8")
    return text, *re.findall(r"^```py\n(.*?)^```", text, re.M | re.S)


def test_table_of_events_on_the_page_of_the_loop(capsys):
    """Time, velocity and length of the pieces of its example, which the first listing prints."""
    text, first, _ = listings_of_the_loop()
    row = re.compile(r"^\| ([\d.]+) \| [^|]*\| \(([\d.]+), ([\de.-]+)\) \| ([\de.-]+) \|", re.MULTILINE)
    told = [[float(number) for number in found] for found in row.findall(text)]
    exec(first, {})
    lines = capsys.readouterr().out.splitlines()
    printed = [[float(number) for number in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", line)] for line in lines]
    assert len(told) == 7 and len(printed) == 24
    for line in told:
        assert min(np.abs(np.subtract(each, line)).max() for each in printed) < 0.005, line
    assert all(line.endswith("bodies meet") for line in lines[:21]) and lines[22].endswith("a slide ends")


def test_exercise_on_the_page_of_the_loop():
    """Times of its events, the wall's blow, and the speeds after them."""
    text, *_ = listings_of_the_loop()
    answer = text.partition("Answer: ")[2]
    wall = Body(HalfSpace((-1.0, 0.0)), motion="fixed", pose=(2.0, 0.0, 0.0))
    disc = Body(Disc(0.5), mass=1.0, inertia=1 / 8, pose=(0.0, 0.5, 0.0), twist=(3.0, 0.0, 0.0))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), wall, disc], (0.0, -10.0), 0.5, 0.2)
    loop, starts, struck = Loop(world_of(model), start_of(model), 1e-11, 2.0), {}, {}
    while loop.state.t < 1.5:
        blows, piece = loop.next_piece()
        t = round(piece.start.t, 9)
        starts[t] = piece.start.velocity[2]
        struck[t] = [blow.acting.impulse.sum(axis=0) for blow in blows]
    assert all(f"{t} s" in answer and t in starts for t in (0.5, 0.625, 0.745, 0.865, 0.985))
    assert np.abs(struck[0.625][0] - (-3.0, 0.6)).max() < 1e-12
    told = {0.5: (2.0, 0.0, -4.0), 0.625: (-1.0, 0.6, -1.6), 0.985: (-0.4, 0.0, 0.8)}
    assert all(np.abs(starts[t] - speeds).max() < 1e-9 for t, speeds in told.items())


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The documentation as HTML, built without a warning."""
    tmp_path = tmp_path_factory.mktemp("built")
    source = tmp_path / "docs"
    tracked = subprocess.run(
        ["git", "ls-files", "docs", ":(glob)*.md"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    for name in tracked.stdout.split():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    for name in ("reference_solver", "reports", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    built = tmp_path / "html"
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(source), str(built)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return built


@pytest.mark.long
def test_build_of_the_documentation_and_its_links(built):
    for page in built.rglob("*.html"):  # links in HTML, which no builder looks at
        for name in re.findall(r'href="((?:\.\./)*\w+\.html)"', page.read_text(encoding="utf-8")):
            assert (page.parent / name).is_file(), (page.name, name)
    assert {path.stem for path in (built / "scenes").glob("*.html")} == {*CATALOGUE, "index"}


#: What is wider than its place (by more than the padding of code), except scripts, and names in tables that break
#: elsewhere than at a dot, bracket, underscore or capital.
CUT = """() => [
  ...[...document.querySelectorAll('article *')].filter(e => e.scrollWidth > e.clientWidth + 8 && e.clientWidth
    && !e.closest('pre') && getComputedStyle(e).display !== 'inline'),
  ...[...document.querySelectorAll('td')].filter(cell => {
    const narrow = cell.scrollWidth;
    cell.style.overflowWrap = 'normal';
    return cell.scrollWidth > narrow;
  })].map(e => e.className + ': ' + e.textContent.trim().slice(0, 60))"""


@pytest.mark.long
@pytest.mark.parametrize("width", [400, 1920])
def test_tables_in_narrow_and_wide_windows(browser, built, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    for file in sorted(built.rglob("*.html")):
        if '<table class="table' in file.read_text(encoding="utf-8"):
            page.goto(file.as_uri())
            assert page.evaluate(CUT) == [], file
    page.close()
