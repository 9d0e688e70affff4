"""What is published is one file that a phone can load."""

from pathlib import Path

PUBLISHED = Path(__file__).parents[2] / "reports" / "published"
#: What a scene may take with its tables, curves and replays [bytes]: 50 of them are the 3 MB of a page that loads in
#: a second at 24 Mbit/s.
EACH = 60_000


def test_the_published_report_is_one_small_file():
    page = (PUBLISHED / "report.html").read_bytes()
    assert len(page) < EACH * page.count(b"class=scene")
    # All of it, not a page that is small because something is missing: scenes, replay and tables are inside.
    assert all(part in page for part in (b'id="replay-heads"', b"rows.json.gz", b"bench.zip", b"class=scene"))
