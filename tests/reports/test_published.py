"""What is published is one file that a phone can load."""

from pathlib import Path

PUBLISHED = Path(__file__).parents[2] / "reports" / "published"
#: One file of 52 scenes, their rows, curves and replays: a second of a phone at 30 Mbit/s.
LIMIT = 3_500_000


def test_the_published_report_is_one_small_file():
    page = (PUBLISHED / "report.html").read_bytes()
    assert len(page) < LIMIT
    # All of it, not a page that is small because something is missing: scenes, replay and tables are inside.
    assert all(part in page for part in (b'id="replay-heads"', b"rows.json.gz", b"bench.zip", b"class=scene"))
