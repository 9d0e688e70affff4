"""Every command that the README names exists with the options it names; its Python snippet runs."""

import re
import shlex
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

from reports.command import main
from validation.cells import Slot
from validation.execution import execute
from validation.store import Store

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
COMMANDS = sorted({line.strip() for line in re.findall(r"^ +(?:\.venv/bin/)?(crosscheck [^#\n]+)", README, re.M)})


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_of_the_readme_exists_with_its_options(line):
    _, name, *words = shlex.split(line.replace("[", " ").replace("]", " ").replace("|", " "))
    command = main.commands[name]
    known = {option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]}
    assert [word for word in words if word.startswith("--") and word not in known] == []
    assert CliRunner().invoke(main, [name, "--help"]).exit_code == 0


def test_there_are_commands_in_the_readme_and_every_command_has_help():
    assert len(COMMANDS) >= 12
    assert all(isinstance(command, click.Command) and command.help for command in main.commands.values())


def test_the_python_snippet_runs(tmp_path, monkeypatch, capsys):
    (snippet,) = re.findall(r"```python\n(.*?)```", README, re.S)
    monkeypatch.chdir(tmp_path)
    slot = Slot("impact", (("e", 0.5),), 2, "chipmunk", "tuned", 1 / 240)
    store = Store(tmp_path / "crosscheck-out")
    run, _ = store.start("quick", [slot])
    store.add(run, execute(slot))
    store.finish(run)
    store.close()
    exec(snippet, {})
    assert "tolerance" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "incomplete", "offered"),
    [
        (["run"], "bou", "bounce"),
        (["run", "bounce", "--engine"], "chip", "chipmunk"),
        (["findings", "--scene"], "st", "stack"),
        (["describe"], "muj", "mujoco"),
    ],
)
def test_the_shell_is_offered_scenes_and_engines(words, incomplete, offered):
    completion = ShellComplete(main, {}, "crosscheck", "_CROSSCHECK_COMPLETE")
    assert offered in [item.value for item in completion.get_completions(words, incomplete)]
