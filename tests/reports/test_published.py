"""What is published is one file that a phone can load."""

from pathlib import Path

PUBLISHED = Path(__file__).parents[2] / "reports" / "published"
#: What the report and all that is published may take [bytes]: what a phone loads in 1.3 s at 24 Mbit/s.
REPORT, ALL = 4_000_000, 6_000_000


def test_the_published_report_is_one_small_file():
    page = (PUBLISHED / "report.html").read_bytes()
    assert len(page) < REPORT and sum(path.stat().st_size for path in PUBLISHED.iterdir()) < ALL
    # All of it, not a page that is small because something is missing: scenes, replay and tables are inside.
    assert all(part in page for part in (b"replay-heads", b"rows.json.gz", b"bench.zip", b"class=scene"))
