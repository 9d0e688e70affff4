"""Tables of what is shown: commands, files and pages about the run that is kept (`kept_run`), word by word.

No engine runs and no picture is drawn: charts are told by their specifications.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial
from html import unescape
from pathlib import Path
from tempfile import mkdtemp
from typing import Any
from unittest.mock import patch

import kept_run
import pandas as pd
from click.testing import CliRunner
from rich.console import Console
from telling import Sections

from reports import exports, speed
from reports.answers import answers
from reports.command import main
from reports.page import charts, choosing, conclusions, load_source, render
from reports.page.families import families
from reports.page.source import Source
from reports.summary import show as show_summary
from reports.wording import row_id
from validation.records.store import Store

#: Every call of a command, without ``--out``, and its width in columns.
CALLS: dict[str, tuple[tuple[str, ...], int]] = {
    "show": (("show",), 100),
    "show-narrow": (("show",), 60),
    "show-all": (("show", "--all"), 140),
    "show-earlier": (("show", "20260101-000000"), 100),
    "show-json": (("show", "--json"), 100),
    "findings": (("findings",), 120),
    "findings-narrow": (("findings",), 70),
    "findings-all": (("findings", "--all"), 120),
    "findings-new": (("findings", "--new"), 120),
    "findings-of": (("findings", "--engine", "mujoco", "--profile", "default", "--scene", "impact"), 120),
    "findings-json": (("findings", "--json", "--new"), 120),
    "compare": (("compare", "20260101-000000", "20260103-000000"), 120),
    "compare-regressed": (("compare", "20260101-000000", "20260103-000000", "--only-regressed"), 120),
    "compare-markdown": (("compare", "20260101-000000", "20260103-000000", "--markdown", "--only-changed"), 120),
    "compare-json": (("compare", "mujoco==3.2.7", "mujoco==3.12.0", "--json"), 120),
    "list-scenes": (("list", "scenes"), 140),
    "list-suites": (("list", "suites"), 140),
    "list-runs": (("list", "runs"), 100),
    "prune": (("prune", "--keep", "1", "--dry-run"), 100),
    "prune-json": (("prune", "--older-than", "3", "--unfinished", "--dry-run", "--json"), 100),
    "nulls-impact": (("nulls", "impact"), 120),
    "nulls-json": (("nulls", "slide", "--json"), 120),
    "describe-bounce": (("describe", "bounce"), 100),
    "describe-stack": (("describe", "stack"), 120),
    "describe-pinch": (("describe", "pinch", "--json"), 120),
    "describe-chipmunk": (("describe", "chipmunk"), 120),
    "describe-mujoco": (("describe", "mujoco"), 120),
}
#: Rows of every kind that ``explain`` is asked for: outcome, mark of physics, standing.
KINDS = (
    ("ok", "fail", "explained"), ("ok", "fail", "known"), ("ok", "fail", "new"), ("ok", "pass", None),
    ("ok", "pass", "drifted"), ("unsupported", None, "known"), ("crashed", None, None),
)  # fmt: skip
#: Lines of a part of a page that are told whatever they are; more of the same follow.
LONGEST = 900
#: Long texts in a page that are none: packed data, and what is hashed of style and script.
#: Padding decides whether a link has quotes, and the packer's version which padding there is: they are left out.
_PACKED = re.compile(r"[A-Za-z0-9+/=]{120,}")
_QUOTED = re.compile(r'"(data:[^"]*)"')
_HASHED = re.compile(r"'sha256-[^']+'")
_CODE = re.compile(r"<(style|script)>.*?</\1>", re.DOTALL)


@cache
def folder() -> Path:
    """Results folder with the run that is kept, made once for all."""
    found = Path(mkdtemp(prefix="crosscheck-kept-"))
    kept_run.fill(found)
    return found


@cache
def source() -> Source:
    """What a page is made from."""
    return load_source(folder())


def said(arguments: Sequence[str], width: int) -> Sections:
    """What a command prints, and its status."""
    call = [*arguments, "--out", str(folder())] if takes_out(arguments[0]) else list(arguments)
    with patch.dict("os.environ", {"COLUMNS": str(width), "NO_COLOR": "1", "TERM": "dumb"}):
        result = CliRunner().invoke(main, call)
    told = {"status": str(result.exit_code)}
    for name, text in (("out", result.stdout), ("err", result.stderr)):
        told |= numbered(text, name)
    return {"said": told}


#: What tells a command that its terminal has colours.
COLOURS = {"COLUMNS": "110", "FORCE_COLOR": "1", "TERM": "xterm", "COLORTERM": ""}


def marks(text: str) -> str:
    """A text for a terminal: what switches styles is told in braces, what moves the cursor is left out."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Zhl]", "", re.sub(r"\x1b\[([0-9;]*)m", r"{\1}", text))


def screen(width: int) -> Console:
    """A terminal with colours of which all is kept, styles and what stands out by itself as well."""
    return Console(
        file=io.StringIO(), width=width, markup=False, emoji=False, force_terminal=True, color_system="standard",
        legacy_windows=False, _environ={"TERM": "xterm"},
    )  # fmt: skip


def on(console: Console, name: str = "out") -> dict[str, str]:
    """What a terminal of that kind was told, line by line, with its styles as marks."""
    assert isinstance(console.file, io.StringIO)
    return numbered(marks(console.file.getvalue()), name)


def coloured() -> Sections:
    """What stands out on a terminal with colours: bold, dim and red are told as marks around it."""
    row = row_id(next(row for row in source().rows if row["standing"] == "new"))
    calls = {"show": ("show",), "all": ("show", "--all"), "findings": ("findings",), "explain": ("explain", row),
             "compare": ("compare", "20260101-000000", "20260103-000000"), "runs": ("list", "runs"),
             "scenes": ("list", "scenes"), "suites": ("list", "suites"), "scene": ("describe", "bounce"),
             "engine": ("describe", "chipmunk"), "nulls": ("nulls", "impact"),
             "prune": ("prune", "--keep", "1", "--dry-run"), "wrong": ("show", "20200101-000000"),
             "unknown": ("describe", "nothing")}  # fmt: skip
    found = Sections()
    for name, call in calls.items():
        out = ("--out", str(folder())) if takes_out(call[0]) else ()
        with patch.dict("os.environ", COLOURS):
            result = CliRunner().invoke(main, [*call, *out], color=True)
        found[name] = {"status": str(result.exit_code)}
        found[name] |= numbered(marks(result.stdout), "out") | numbered(marks(result.stderr), "err")
    return found


def takes_out(command: str) -> bool:
    """Whether a command has ``--out``."""
    return any("--out" in option.opts for option in main.commands[command].params)


def numbered(text: str, name: str) -> dict[str, str]:
    """Lines of a text by their number; paths of this machine are none."""
    plain = text.replace(str(folder()), "OUT")
    return {f"{name} {k:04d}": f"|{line}|" for k, line in enumerate(plain.splitlines(), 1)}


def explained(kind: tuple[str, str | None, str | None]) -> Sections:
    """What ``explain`` says of the first row of a kind, and of one of them as data."""
    row = next(row for row in source().rows if (row["outcome"], row["physics"], row["standing"]) == kind)
    found = {row["metric"]: said(("explain", row_id(row)), 110)["said"]}
    if kind[2] == "known":
        found["as data"] = said(("explain", row_id(row), "--json"), 110)["said"]
    return found


# ---- files -----------------------------------------------------------------------------------------------------------


def exported() -> Sections:
    """What a run writes beside the store, of rows of all kinds, a few of each."""
    kinds: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for row in source().rows:
        kinds.setdefault((row["outcome"], row["physics"], row["standing"]), []).append(row)
    rows = [row for own in kinds.values() for row in own[:3]]
    texts = {
        "rows.csv": exports.as_csv(rows),
        "rows.jsonl": exports.as_jsonl(rows[:6]),
        "summary.md": exports.as_markdown(rows),
        "junit.xml": exports.as_junit(rows).replace("><", ">\n<"),
    }
    return {name: numbered(text, "line") for name, text in texts.items()}


def benched() -> Sections:
    """Tables about speed: on the terminal, and as data."""
    bench = source().bench
    assert bench is not None
    console, tables = screen(140), bench.tables
    for table in (
        *speed.level_tables(tables["work_points"]), *speed.level_tables(tables["work_points"], ranked=False),
        speed.overhead_table(tables["overhead"]), speed.scaling_table(tables["scaling"], tables["scaling_fits"]),
    ):  # fmt: skip
        console.print(table)
    console.print(speed.quality_line(tables["timings"]), speed.busy(tables["timings"]), speed.key(True))
    found = {"terminal": on(console, "line")}
    for name, table in tables.items():
        found[name] = {
            f"{k:03d}": json.dumps(row, sort_keys=True, default=str) for k, row in enumerate(speed.plain(table)[:12])
        }
        found[name]["rows"] = str(len(table))
    store = Store(folder(), create=False)
    try:
        costs = speed.cheapest_passing(store, bench.run)
    finally:
        store.close()
    found["cheapest"] = {" ".join(map(str, key)): f"{cost:.9g}" for key, cost in costs.items()}
    return found


#: Rows of which the page's sentences are told: what is said where nothing, or nothing else, is there.
PARTS: dict[str, Callable[[Mapping[str, Any]], bool]] = {
    "none": lambda row: False,
    "passes": lambda row: row["physics"] == "pass" and row["standing"] is None,
    "explained": lambda row: row["standing"] in (None, "explained") and row["outcome"] == "ok",
    "known": lambda row: row["standing"] == "known",
    "new": lambda row: row["standing"] in ("new", "drifted"),
    "crashed": lambda row: row["outcome"] in ("crashed", "timed_out"),
    "refused": lambda row: row["outcome"] == "unsupported",
    "unlisted": lambda row: row["standing"] is None and row["outcome"] == "ok",
    "shipped": lambda row: row["profile"] == "default",
    "ours": lambda row: row["engine"] == "reference",
    "one scene": lambda row: row["scene"] == "slide",
    "two": lambda row: row["engine"] in ("chipmunk", "bullet") and row["scene"] in ("impact", "bounce"),
}


def part_of(name: str) -> Source:
    """What a page is made from, of a part of the rows and the cells that have them; without bench and replays."""
    rows = [row for row in source().rows if PARTS[name](row)]
    keys = {json.dumps(row["slot"], sort_keys=True) for row in rows}
    seen = [o for o in source().observations if json.dumps(o.slot.as_dict(), sort_keys=True) in keys]
    return Source(source().run, rows, seen, nulls=source().nulls)


def sentences() -> Sections:
    """What the page and the terminal conclude from parts of the rows."""
    found = Sections()
    for name in PARTS:
        part = part_of(name)
        rows = part.rows
        said = {f"sentence {k}": f"{head}: {text}" for k, (head, text) in enumerate(conclusions.sentences(part))}
        said |= {f"family {k}": str(each) for k, each in enumerate(families(part))}
        said |= {f"choice {k}": str(each) for k, each in enumerate(choosing.choices(part))}
        said |= {f"answer {k}": each.line for k, each in enumerate(answers(rows))}
        console = screen(100)
        show_summary(rows, console)
        found[name] = said | on(console, "terminal")
    return found


# ---- pages -----------------------------------------------------------------------------------------------------------


@contextmanager
def undrawn() -> Iterator[list[dict[str, Any]]]:
    """Charts are not drawn but told: their specifications in the order in which they were asked for."""
    asked: list[dict[str, Any]] = []

    def tell(spec: dict[str, Any]) -> str:
        asked.append(spec)
        return f'<svg class="marks"><text>chart {len(asked)}</text></svg>'

    with patch.object(charts.vl_convert, "vegalite_to_svg", tell):
        yield asked


@cache
def pages() -> tuple[str, tuple[dict[str, Any], ...]]:
    """The report, and the specifications of its charts."""
    with undrawn() as asked:
        return render(source()), tuple(asked)


def page_parts() -> Sections:
    """The report, tag by tag, in parts that begin with a heading; packed data is told unpacked where it is text.

    Of a long part the first `LONGEST` lines are told, and each further one that stands nowhere before it.
    """
    parts, title, met = Sections({"top": {}}), "top", set[str]()
    for line in tags(pages()[0]):
        if re.match(r"<h[12]\b", line):
            title = f"{len(parts)} {line.partition('>')[2]}"[:60]
            parts[title] = {}
        parts[title][f"{len(parts[title]):04d}"] = line
    found = Sections()
    for title, own in parts.items():
        found[title] = {}
        for k, (place, line) in enumerate(own.items()):
            if k < LONGEST or line not in met:
                found[title][place] = line
            met.add(line)
        found[title]["lines"] = str(len(own))
    return found


def tags(page: str) -> list[str]:
    """A page tag by tag, each with what stands behind it; without those that only end something."""
    text = _CODE.sub(lambda found: f"<{found[1]}>", page)
    pieces = (_PACKED.sub(unpacked, _QUOTED.sub(r"\1", piece)) for piece in re.split(r"(?=<)", text))
    lines = (" ".join(_HASHED.sub("'sha256'", unescape(piece)).split()) for piece in pieces)
    return [line for line in lines if line and line not in ("</td>", "</tr>", "</li>", "</span>")]


def pages_of_parts() -> Sections:
    """The report over parts of the rows: what stands in each that the whole report does not say, and its charts."""
    whole, found = set(tags(pages()[0])), Sections()
    for name in ("none", "new", "crashed", "refused", "one scene", "two"):
        with undrawn() as asked:
            lines = tags(render(part_of(name)))
        others = dict.fromkeys(line for line in lines if line not in whole and ";base64," not in line)
        found[name] = {f"{k:03d}": line for k, line in enumerate(others)}
        found[name] |= {"lines": str(len(lines)), "charts": str(len(asked))}
    return found


def unpacked(found: re.Match[str]) -> str:
    """Packed text is told by its head, and how long it is; what is no text by its name alone."""
    try:
        text = gzip.decompress(base64.b64decode(found[0])).decode()
    except (OSError, ValueError, EOFError):
        return "(packed)"
    return f"(packed: {text[:200]} ... of {len(text)})"


def page_charts() -> Sections:
    """Specifications of the charts: scales, axes, marks, and the first points of each."""
    found = Sections()
    for k, spec in enumerate(pages()[1], 1):
        plain = {key: value for key, value in spec.items() if key not in ("config", "$schema")}
        data = plain.pop("datasets", {})
        lines = dict(_flat(json.loads(json.dumps(plain, default=str, sort_keys=True)), ""))
        own = {path: told for path, told in lines.items() if not path.endswith(("data.name", ".name", ".views[0]"))}
        for m, rows in enumerate(data.values()):
            own[f"points {m}"] = f"{len(rows)}"
            own |= {f"points {m} {n:02d}": json.dumps(row, sort_keys=True) for n, row in enumerate(rows[:8])}
        found[f"chart {k}"] = own
    return found


def _flat(value: Any, path: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _flat(part, f"{path}.{key}")
    elif isinstance(value, list):
        for k, part in enumerate(value):
            yield from _flat(part, f"{path}[{k}]")
    else:
        yield path, str(value)


def dashboard() -> Sections:
    """The page over all runs and releases, tag by tag."""
    from reports.dashboard import render as drawn
    from reports.dashboard.series import panels

    store = Store(folder(), create=False)
    try:
        text = drawn(panels(store, folder()), "Kept")
    finally:
        store.close()
    text = _HASHED.sub("'sha256'", _CODE.sub(lambda found: f"<{found[1]}>", text))
    lines = [" ".join(unescape(piece).split()) for piece in re.split(r"(?=<)", text)]
    return {"dashboard": {f"{k:04d}": line for k, line in enumerate(filter(None, lines))}}


def data_frame() -> Sections:
    """What a notebook gets of a run: columns and their kinds, and some rows."""
    found = exports.load(folder(), nulls=True)
    kinds = {f"column {name}": str(kind) for name, kind in found.dtypes.items()}
    told = pd.concat([found.head(3), found.tail(3)]).to_dict("records")
    rows = {f"row {k} {name}": str(value) for k, row in enumerate(told) for name, value in row.items()}
    return {"frame": kinds | rows | {"rows": str(len(found))}}


def makers() -> dict[str, Callable[[], Sections]]:
    """Tables of all that is shown."""
    found: dict[str, Callable[[], Sections]] = {
        f"print/{name}": partial(said, call, width) for name, (call, width) in CALLS.items()
    }
    return found | {
        **{f"print/explain-{'-'.join(map(str, kind))}": partial(explained, kind) for kind in KINDS},
        "print/coloured": coloured, "print/sentences": sentences, "print/files": exported, "print/bench": benched,
        "print/frame": data_frame,
        "print/page": page_parts, "print/parts-of-page": pages_of_parts, "print/charts": page_charts,
        "print/dashboard": dashboard,
    }  # fmt: skip
