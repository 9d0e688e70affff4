"""What is published is one file that a phone can load."""

from pathlib import Path

from adapters import registry
from reports.symptoms.published import of_matrix

PUBLISHED = Path(__file__).parents[2] / "reports" / "published"
#: What the report and all that is published may take [bytes]: what a phone loads in 1.3 s at 24 Mbit/s.
REPORT, ALL = 4_000_000, 6_000_000


def test_the_published_report_is_one_small_file():
    page = (PUBLISHED / "report.html").read_bytes()
    assert len(page) < REPORT and sum(path.stat().st_size for path in PUBLISHED.iterdir()) < ALL
    # All of it, not a page that is small because something is missing: scenes, replay and tables are inside.
    assert all(part in page for part in (b"replay-heads", b"rows.json.gz", b"bench.zip", b"class=scene"))


def test_each_optional_engine_has_results_in_the_matrix():
    """Ports are compared on a page of their own."""
    found = {(engine, scene) for engine, _, _, scene, _, _, judged in of_matrix() if judged}
    extras = [
        name for name in registry.names() if (facts := registry.facts(name)) and facts.apart and not facts.port_of
    ]
    assert extras and all((name, "incline") in found for name in extras)
