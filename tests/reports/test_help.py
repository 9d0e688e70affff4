"""Help leads from the first command to the rare ones: whole lines, and an example that can be typed."""

import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports.command import group, main
from reports.command.group import SECTIONS


def helped(*words):
    return CliRunner(env={"COLUMNS": "80"}).invoke(main, [*words, "--help"]).output


def test_section_and_line_of_every_command():
    listed = main.list_commands(None)
    assert len(listed) == len(set(listed)) == sum(map(len, SECTIONS.values()))
    lines = helped().splitlines()
    for name in listed:
        (line,) = [line for line in lines if line.split()[:1] == [name]]
        assert line.endswith(".") and "..." not in line and len(line) <= 80
    assert [line[:-1] for line in lines if line.endswith(":")][1:] == list(SECTIONS)


def test_help_lines_of_all_commands():
    """`SECTIONS` has them, so that a list of commands imports none of these."""
    lines = {name: line for section in SECTIONS.values() for name, (_, line) in section.items()}
    assert {name: main.get_command(None, name).help.partition("\n")[0] for name in lines} == lines
    decorated = {
        path.stem for path in Path(group.__file__).parent.glob("*.py") if "\n@main.command(" in path.read_text()
    }
    assert decorated == {module for section in SECTIONS.values() for module, _ in section.values()}
    assert sorted(main.commands) == sorted(lines)


@pytest.mark.parametrize("name", main.list_commands(None))
def test_arguments_and_options_of_examples(name):
    command = main.get_command(None, name)
    said, _, example = command.epilog.partition(": ")
    assert said == "Example" and " ".join(helped(name).split()).endswith(example)
    first, second, *words = shlex.split(example.partition(" < ")[0])
    assert (first, second) == ("crosscheck", name)
    for word in words:
        assert not word.startswith("-") or any(word in each.opts + each.secondary_opts for each in command.params), word
    command.make_context(name, [word.replace("ENGINE", "reference") for word in words], resilient_parsing=True)
