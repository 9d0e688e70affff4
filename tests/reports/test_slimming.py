"""What makes the page small: pictures look the same, markup means the same, and both are smaller."""

import itertools
import math
import re
from html.parser import HTMLParser

import pytest

from reports.page.slimming import FLAT, simplified, small_html, small_path, small_svg


def distance(point, a, b):
    length = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    share = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / length if length else 0.0
    share = min(1.0, max(0.0, share))
    return math.dist(point, (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))


CURVE = [(4.13 * k, 125.0 + 100.0 * math.cos(0.06 * k) * math.exp(-0.02 * k)) for k in range(150)]


def corners(drawn):
    """Points of a path whose first place is absolute and all that follows it relative."""
    at, found = (0.0, 0.0), []
    for letter, numbers in re.findall("([Mlhv])([^Mlhv]*)", drawn):
        values = [float(number) for number in re.findall(r"-?[0-9.]+", numbers)]
        steps = (
            zip(values[::2], values[1::2], strict=True)
            if letter in "Ml"
            else [(value, 0.0) if letter == "h" else (0.0, value) for value in values]
        )
        for dx, dy in steps:
            at = (at[0] + dx, at[1] + dy)
            found.append(at)
    return found


def test_no_point_of_a_curve_is_farther_from_what_is_drawn_than_said():
    drawn = small_path("M" + "L".join(f"{x:.2f},{y:.2f}" for x, y in CURVE))
    kept = corners(drawn)
    assert len(kept) < 0.7 * len(CURVE)
    off = max(min(distance(p, a, b) for a, b in itertools.pairwise(kept)) for p in CURVE)
    assert off <= FLAT + 0.1  # steps are in tenths, and do not add up


def test_a_straight_run_is_one_line_and_a_corner_stays():
    assert small_path("M0,0L1,0L2,0L3,0L3,5L3,9") == "M0,0h3v9"
    assert simplified([(0.0, 0.0), (1.0, 3.0), (0.0, 0.0)], 0.25) == [(0.0, 0.0), (1.0, 3.0), (0.0, 0.0)]
    assert small_path("M3.39,0A3.39,3.39,0,1,1,-3.39,0") == "M3.39,0A3.39,3.39,0,1,1,-3.39,0"


def test_one_look_is_said_once_and_parts_that_differ_keep_theirs():
    small = small_svg(
        '<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="a &lt;b&gt;"><g class="x"><g transform='
        '"translate(0,0)"><line x2="0" y2="4" stroke="red"/><line transform="translate(3,1)" x2="0" y2="4" '
        'stroke="red"/></g><g><path aria-label="one &amp; only" role="graphics-symbol" d="M0,0L1,1" stroke="blue"/></g>'
        "</g></svg>"
    )
    assert small == (
        '<svg role="img" aria-label="a &lt;b&gt;"><g stroke="red"><path d="M0,0v4M3,1v4"/></g>'
        '<path d="M0,0l1,1" stroke="blue" data-is="one &amp; only"/></svg>'
    )
    assert "class" not in small and "graphics-symbol" not in small and 'role="img"' in small


def test_what_svg_takes_for_granted_is_left_out_unless_a_group_says_otherwise():
    small = small_svg(
        '<svg version="1.1" role="img" aria-label="a"><g stroke-width="3" font-family="serif"><path d="M0,0L9,9" '
        'stroke="red" stroke-width="1"/><path d="M0,0L9,9" stroke="red"/></g><path d="M0,0L9,9" stroke="red" '
        'stroke-width="1" stroke-dasharray="1,0"/><line transform="translate(80.87,18.04) rotate(-90)" x2="0" '
        'y2="-4.96" stroke-dasharray="5,3"/></svg>'
    )
    assert small == (
        '<svg role="img" aria-label="a"><g stroke-width="3" stroke="red"><path d="M0,0l9,9" stroke-width="1"/>'
        '<path d="M0,0l9,9"/></g><path d="M0,0l9,9" stroke="red"/>'
        '<line transform="translate(80.9,18) rotate(-90)" y2="-5" stroke-dasharray="5,3"/></svg>'
    )


class Seen(HTMLParser):
    """Tags with attributes, and text: what a browser is given, closing tags aside."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.said = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, tuple(attrs)))

    def handle_data(self, data):
        self.said += data


def test_markup_means_the_same():
    page = (
        '<table class="grid wide">\n  <tr id="a-1"><th>x</th><td class="n" title="a b">1 < 2</td></tr>\n'
        '</table><pre>\n  </td> kept </td>\n</pre><script>if (a) { "</li>  \n  " }</script><ul><li>y</li>\n</ul>'
    )
    small = small_html(page)
    assert Seen(small).tags == Seen(page).tags
    assert Seen(small).said.split() == Seen(page).said.split()
    assert "<pre>\n  </td> kept </td>\n</pre>" in small and '"</li>  \n  "' in small
    assert "class=n" in small and 'class="grid wide"' in small


HEAD = '<thead><tr><th scope="col">a</th><th scope="col">b</th></tr></thead>'


@pytest.mark.parametrize(
    ("table", "left"),
    [
        (HEAD + '<tr><th scope="row">x</th><td>1</td></tr>', set()),
        (HEAD + "<tr><td>x</td><td>1</td></tr>", set()),
        # A head beside another, below data, or over several places is not known by its place.
        (HEAD + '<tr><th scope="row">x</th><th scope="row">y</th><td>1</td></tr>', {"row"}),
        (HEAD + '<tr><td>0</td><th scope="row">x</th></tr>', {"row"}),
        (HEAD + '<tr><th scope="row">x</th></tr><tr><th scope="row">y</th><td>1</td></tr>', {"col", "row"}),
        ('<tr><td>1</td><th scope="col">x</th></tr>', {"col"}),
        ('<tr><th scope="colgroup" colspan="2">a</th></tr><tr><th scope="row">x</th><td>1</td></tr>',
         {"colgroup", "row"}),
    ],
)  # fmt: skip
def test_a_head_says_of_what_it_is_where_its_place_does_not(table, left):
    assert set(re.findall(r"scope=\"?(\w+)", small_html(f"<table>{table}</table>"))) == left


@pytest.mark.parametrize(
    "quoted",
    ['<input value="a b">', '<td title="">', '<a href="data:x;base64,AA==">', '<td title="a`b">', "<td title='a'>"],
)
def test_quotes_stay_where_they_are_needed(quoted):
    assert small_html(quoted) == quoted


@pytest.mark.parametrize(
    ("quoted", "plain"),
    [
        ('<a href="#x" title="a/b">', "<a href=#x title=a/b>"),
        ('<path d="M0-1h2"/>', "<path d=M0-1h2 />"),
        ('<a href="x/">', "<a href=x/>"),
        ('<a title="&quot;">x="y"</a>', '<a title=&quot;>x="y"</a>'),
    ],
)
def test_quotes_go_where_a_blank_ends_the_value(quoted, plain):
    assert small_html(quoted) == plain
    assert Seen(plain).tags == Seen(quoted).tags and Seen(plain).said == Seen(quoted).said


def test_marks_are_drawn_where_they_lie():
    small = small_svg(
        '<svg role="img" aria-label="a"><path d="M3,0A3,3,0,1,1,-3,0A3,3,0,1,1,3,0" fill="red" '
        'transform="translate(80.25,4)"/><path d="M-3.16,-3.16h6.33v6.33h-6.33Z" fill="blue" '
        'transform="translate(7,30)"/><line transform="translate(9.04,4)" x2="7.5" y2="-1" stroke="red"/>'
        '<text transform="translate(0,18)">1</text><path d="M1,2Z" stroke="blue"/>'
        '<path d="M0,0C1,1,2,2,3,3" fill="red" transform="translate(5,5)"/></svg>'
    )
    assert small == (
        '<svg role="img" aria-label="a"><circle fill="red" cx="80.2" cy="4" r="3"/>'
        '<path d="M3.8,26.8h6.4v6.4h-6.4Z" fill="blue"/><path stroke="red" d="M9,4l7.5-1"/><text y="18">1</text>'
        '<path d="M0,0C1,1,2,2,3,3" fill="red" transform="translate(5,5)"/></svg>'
    )


def test_how_far_one_sees_through_is_said_by_the_group_only_of_what_is_painted_once():
    """A group's own opacity would be another picture where its parts overlap; a line's and a filling's are not."""
    small = small_svg(
        '<svg role="img" aria-label="a" fill="none"><g><path d="M0,0h9" stroke="red" opacity="0.7"/><path d="M0,5h9" '
        'stroke="blue" opacity="0.7"/></g><g><path d="M0,0h9v9Z" fill="red" opacity="0.3"/><path d="M0,0h9v9Z" '
        'fill="red" stroke="blue" opacity="0.3"/></g></svg>'
    )
    assert '<g stroke-opacity="0.7"><path d="M0,0h9" stroke="red"/>' in small
    assert 'd="M0,0h9v9Z" fill-opacity="0.3"/>' in small and 'stroke="blue" opacity="0.3"/>' in small


def test_an_outline_that_closes_keeps_every_corner_and_a_part_after_it_begins_where_it_began():
    assert small_path("M0,0h4h4v8h-8Zl1,1M2,2V4H5") == "M0,0h4,4v8h-8ZM0,0l1,1M2,2v2h3"
