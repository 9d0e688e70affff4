"""`make certify ARGS="--random N"`: what differs or does not answer fails the command, and no scene can stop it."""

import json
import os
import time

import numpy as np
import pytest
from click.testing import CliRunner

from tests.verification import certify as command
from tests.verification import fuzzing


def answer(seed, dimension=2, **changed):
    plain = {
        "seed": seed, "dimension": dimension, "certified": True, "conditions": {}, "bound": 1e-10, "off": 5e-11,
        "farthest": "a third of the tolerance", "defects": [], "refused_variants": {},
    }  # fmt: skip
    return plain | changed


def certify(monkeypatch, *answers, flags=("--dim", "2")):
    asked = []

    def attacked(jobs):
        asked.extend(jobs)
        return iter(answers)

    monkeypatch.setattr(fuzzing, "attacked", attacked)
    return CliRunner().invoke(command.certify, ["--random", "3", "--seed", "5", *flags]), asked


def test_scenes_that_agree_pass(monkeypatch):
    result, asked = certify(monkeypatch, answer(5), answer(6), answer(7))
    assert result.exit_code == 0 and asked == [(5, 2), (6, 2), (7, 2)]
    assert "3 scenes, 3 certified, 0 refused" in result.stderr
    assert "half below 0.5" in result.stderr


def test_dimensions_by_default(monkeypatch):
    _, asked = certify(monkeypatch, flags=())
    assert asked == [(seed, d) for d in (2, 3) for seed in (5, 6, 7)]


def test_rows_with_accumulating_impacts_requested_by_name(monkeypatch):
    _, asked = certify(monkeypatch, flags=("--dim", "2", "--chains"))
    assert asked == [(5, 2, "chains"), (6, 2, "chains"), (7, 2, "chains")]


def test_differing_certified_scene_fails_by_name(monkeypatch):
    result, _ = certify(monkeypatch, answer(6, defects=[["mirrored", 0.25, 1e-5, 2e-12]]))
    assert result.exit_code == 1
    assert "DEFECT seed 6, mirrored: 1.00e-05 m apart at 0.25 s" in result.stderr


def test_refusals_counted_apart_from_wrong_answers(monkeypatch):
    refused = [
        answer(5, certified=False, conditions={"cone": 2e-7}, off=1e-12),
        answer(6, certified=False, conditions={"cone": 3e-5, "endless": 1.0}, off=1e-4),
        answer(7, certified=False, conditions={"endless": 2.0}, off=float("inf")),
    ]
    result, _ = certify(monkeypatch, *refused, flags=("--dim", "2", "--json"))
    assert result.exit_code == 0  # a refusal is honest
    rows = [line.split("│")[1:-1] for line in result.stderr.splitlines() if line.startswith("│")]
    assert [[cell.strip() for cell in row] for row in rows] == [
        ["cone", "2", "1", "1", "3.0e-5", "5 6"],
        ["endless", "2", "1", "2", "2", "6 7"],
    ]
    assert [each["off"] for each in json.loads(result.stdout)] == [1e-12, 1e-4, None]


def test_no_answer_fails(monkeypatch):
    result, _ = certify(monkeypatch, {"seed": 6, "dimension": 2, "broken": "ValueError: no"})
    assert result.exit_code == 1 and "NO ANSWER seed 6: ValueError: no" in result.stderr


def serve_badly(connection):
    """Answers of a child: seed 0 plainly, 1 never, 2 by its death."""
    connection.send_bytes(fuzzing.READY)
    while True:
        seed, dimension = json.loads(connection.recv_bytes())
        if seed == 1:
            time.sleep(600.0)
        if seed == 2:
            os._exit(3)
        connection.send_bytes(json.dumps(answer(seed, dimension)).encode())


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="children are guarded by a fork")
def test_scenes_beside_a_hanging_or_crashing_one(monkeypatch):
    monkeypatch.setattr(fuzzing, "serve", serve_badly)
    found = {each["seed"]: each for each in fuzzing.attacked([(1, 2), (2, 2), (0, 2), (3, 3)], limit=20.0)}
    assert "no answer after" in found[1]["broken"] and "exit code 3" in found[2]["broken"]
    assert "broken" not in found[0] and "broken" not in found[3]


def test_exception_of_a_scene_as_its_answer():
    sent = []

    asked = [json.dumps([3, 5]).encode()]

    class Connection:
        def recv_bytes(self):
            if not asked:
                raise EOFError
            return asked.pop()

        send_bytes = sent.append

    fuzzing.serve(Connection())
    assert sent[0] == fuzzing.READY and json.loads(sent[1])["broken"]


def test_exception_of_a_scene_in_one_line(monkeypatch):
    """The first that says something, however long the whole is, and however narrow the terminal."""

    def raised(seed, dimension):
        raise np.linalg.LinAlgError("\n[0, 0] of the matrix is singular\n" + 40 * " 0.0 0.0\n")

    sent, asked = [], [b"[3, 2]"]

    class Connection:
        send_bytes = sent.append

        def recv_bytes(self):
            if not asked:
                raise EOFError
            return asked.pop()

    monkeypatch.setattr(fuzzing, "attack", raised)
    fuzzing.serve(Connection())
    result, _ = certify(monkeypatch, json.loads(sent[1]))
    lines = result.stderr.splitlines()
    (at,) = (k for k, line in enumerate(lines) if "NO ANSWER" in line)
    assert lines[at:] == ["NO ANSWER seed 3: LinAlgError: [0, 0] of the matrix is singular"]
    long = answer(4) | {"broken": "the process was killed by SIGSEGV " + 20 * "and so on, " + "to its end"}
    result, _ = certify(monkeypatch, long)
    assert result.stderr.splitlines()[-1] == f"NO ANSWER seed 4: {long['broken']}"


def test_the_command_hands_over(monkeypatch):
    monkeypatch.setattr(command, "show_random", lambda console, as_json, count, seed, dims, chains: 7 + chains)
    assert CliRunner().invoke(command.certify, ["--random", "1"]).exit_code == 7
    assert CliRunner().invoke(command.certify, ["--random", "1", "--chains"]).exit_code == 8


def test_refusals_by_frequency_with_counts():
    """Of each condition: scenes that it refused, alone, those that were wrong, its worst value, and their seeds."""
    refused = [
        answer(1, certified=False, conditions={"residual": 2.0}, off=1.0),
        answer(2, certified=False, conditions={"residual": 5.0, "energy": 3.0}),
        answer(3, certified=False, conditions={"residual": float("nan")}),
    ]
    table = fuzzing._refusals(refused)
    assert [column.header for column in table.columns] == ["condition", "scenes", "alone", "off", "worst", "seeds"]
    cells = list(zip(*(column.cells for column in table.columns), strict=True))
    assert [row[:4] for row in cells] == [("residual", "3", "2", "1"), ("energy", "1", "0", "0")]
    assert [row[4:] for row in cells] == [("5", "1 2 3"), ("3", "2")]
    assert [column.no_wrap for column in table.columns] == [True] * 5 + [False]


def test_progress_of_a_fuzzing_run(monkeypatch):
    said = []

    class Status:
        def __enter__(self):
            return self

        def __exit__(self, *ended):
            said.append("over")

        update = said.append

    class Console:
        def status(self, text):
            said.append(text)
            return Status()

        def print(self, *given, **named):
            pass

    monkeypatch.setattr(fuzzing, "attacked", lambda jobs: iter([answer(5), answer(6)]))
    assert fuzzing.show_random(Console(), False, 2, 5, (2,)) == 0
    assert said == ["attacking", "1 of 2", "2 of 2", "over"]
