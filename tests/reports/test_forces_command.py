"""``forces``: the kept tables of contact forces, on the terminal."""

from click.testing import CliRunner

from reports.command import main


def test_kept_table_of_an_engine_that_is_not_installed():
    """With the engine's name it was refused, without a name it was shown."""
    told = CliRunner().invoke(main, ["forces", "box2d"])
    assert told.exit_code == 0 and "PostSolve" in told.output
    assert "(1/480): in 1 of 480 steps" in " ".join(told.output.split())


def test_name_of_no_engine():
    told = CliRunner().invoke(main, ["forces", "bulet"])
    assert told.exit_code == 2 and "did you mean 'bullet'?" in told.output
