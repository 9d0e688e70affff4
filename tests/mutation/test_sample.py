"""A sample that is kept: what it missed is asked again where it stands today, and the estimate stays what it was."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

SOURCE = "def twice(x):\n    return 2 * x\n"


@pytest.fixture
def tools(imported, monkeypatch, tmp_path):
    """`sample` over one module of its own, and `drawn`, whose sample is kept in a file of the test's own."""
    sample, drawn = imported("sample"), imported("drawn")
    (tmp_path / "toy.py").write_text(SOURCE)
    (tmp_path / "pyproject.toml").write_text('[tool.mutmut]\nsource_paths = ["toy.py"]\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sample, "ROOT", tmp_path)
    monkeypatch.setattr(drawn, "DRAWN", tmp_path / "sample.csv")
    return sample, drawn


def test_what_was_missed_meets_the_tests_of_now_where_its_code_is_as_it_was(tools, monkeypatch):
    sample, drawn = tools
    tree, mutations = sample.mutations_of("toy.py")
    changes = [sample.change_of(tree, mutation) for _, mutation in mutations]
    assert "return 2 * x -> return 2 / x" in changes and "return 2 * x -> return 3 * x" in changes
    first = drawn.Drawn(7, 0, "other", "toy.py", "toy.x_twice", "return 2 * x -> return 2 / x", "killed", 1, "t")
    rows = [
        first,
        replace(first, number=1, change="return 2 * x -> return 3 * x", verdict="survived"),
        replace(first, number=2, change="return x + x -> return x - x", verdict="survived"),
        replace(first, number=3, module="gone.py", function="gone.x_f", verdict="unreached"),
        replace(first, number=4, change="return 2 * x -> return 2 / x", verdict="survived", now="killed", failed="s"),
        replace(first, number=5, change="return 2 * x -> return 3 * x", verdict="survived", reason="as true"),
    ]
    drawn.write(rows)
    met = []

    def verdict(module, tree, function, mutation):
        met.append((module, function, sample.change_of(tree, mutation)))
        return "killed", 2, "tests/test_toy.py::test_twice"

    monkeypatch.setattr(sample.Bench, "of", lambda folder: SimpleNamespace(verdict=verdict))
    sample.again(Path("nowhere"), False)
    assert met == [("toy.py", "toy.x_twice", "return 2 * x -> return 3 * x")]
    found = drawn.stored()
    assert [row.now for row in found] == ["", "killed", "gone", "gone", "killed", ""]
    assert [row.verdict for row in found] == [row.verdict for row in rows]  # what was drawn stays as it was found
    assert (found[1].tests, found[1].failed) == (2, "tests/test_toy.py::test_twice")
    assert [found[k] for k in (0, 4, 5)] == [rows[k] for k in (0, 4, 5)]
    assert "**1 of 6 are noticed, 16.7 %" in "\n".join(drawn.table(found))


def test_samples_of_two_seeds_stand_together_and_each_is_told(tools):
    _, drawn = tools
    first = drawn.Drawn(11, 1, "of", "reports/a.py", "reports.a.x_f", "a -> b", "killed", 1, "t")
    rows = [
        first,
        replace(first, seed=7, number=3),
        replace(first, seed=7, verdict="survived"),
        replace(first, number=0),
    ]
    drawn.write(rows)
    assert [(row.seed, row.number) for row in drawn.stored()] == [(7, 1), (7, 3), (11, 0), (11, 1)]
    text = "\n".join(drawn.table(drawn.stored()))
    assert "4 mutants, drawn by the seed 7 (1 of 2) and 11 (2 of 2) from all" in text
    assert "**3 of 4 are noticed, 75.0 %" in text


def test_files_near_a_function_import_its_module_first_and_are_of_its_name_then(tools, monkeypatch, tmp_path):
    sample, _ = tools
    texts = {
        "tests/test_words.py": "they pile up where walls turn", "tests/test_other.py": "nothing of it",
        "tests/test_walls.py": "", "tests/test_deep.py": "from adapters.toy import (x, walls)",
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(sample, "test_files", lambda: list(texts))
    found = sample.near("adapters/toy/walls.py", "adapters.toy.walls.x_pile")
    tables = [f"tests/tables/test_of_{name}.py" for name in sample.TABLES["adapters"]]
    assert found == ["tests/test_deep.py", "tests/test_walls.py", "tests/test_words.py", *tables]


def test_a_test_beside_the_code_is_asked_before_one_that_costs_nothing_once_a_page_is_made(imported):
    sample = imported("sample")
    tests = {
        "page.py::test_words": 0.0,
        "unit.py::test_sum[a]": 0.05,
        "unit.py::test_sum[b]": 0.06,
        "unit.py::test_z": 1,
    }
    order = [test for test, _ in sample.in_turn(tests, {"page.py": 15.0, "unit.py": 0.2})]
    assert order == ["unit.py::test_sum[a]", "unit.py::test_sum[b]", "unit.py::test_z", "page.py::test_words"]
    assert dict(sample.in_turn(tests, {"page.py": 15.0, "unit.py": 0.2})) == tests


def test_a_cheap_case_of_many_is_asked_before_dear_tests_and_no_test_fills_the_time_with_its_cases(imported):
    sample = imported("sample")
    tests = {f"cases.py::test_each[{k:03}]": 0.0 for k in range(500)} | {"one.py::test_long": 2.0}
    order = [test for test, _ in sample.in_turn(tests, {"cases.py": 0.0, "one.py": 0.0})]
    assert order.index("one.py::test_long") == 199  # the 200th case of a hundredth of a second counts as its two


def test_what_lives_meets_what_was_too_dear_and_is_noticed_by_what_fails_again_by_itself(tools, monkeypatch, tmp_path):
    """A test that fails without the mutant, or only once, or whose time is over, has not noticed it."""
    sample, drawn = tools
    cheap, dear, last = (f"test_toy.py::test_{name}" for name in ("cheap", "dear", "last"))
    costs = {cheap: 1.0, dear: 100.0, last: 400.0}
    known = {"test_toy.py": sample.Record({test: (cost, []) for test, cost in costs.items()}, 0.0, True, 500.0)}
    tree, mutations = sample.mutations_of("toy.py")
    bench = sample.Bench(tmp_path, known, {"toy.x_twice:0": costs})
    monkeypatch.setattr(sample, "cut_short", lambda known, module: [])

    def found(*ends):
        """Ends of further calls with the mutant, then of those without it: status of the dear test in each."""
        calls, left = [], list(ends)

        def asked(copy, tests, *rest):
            spoilt = (copy / "toy.py").read_text() != SOURCE
            calls.append((tuple(tests), spoilt))
            status = 0 if tests == [cheap] else left.pop(0)
            return status, dear if status == 1 else ""

        monkeypatch.setattr(sample, "asked", asked)
        verdict = bench.verdict("toy.py", tree, *mutations[0])
        assert (tmp_path / "toy.py").read_text() == SOURCE
        return verdict, calls

    first, second, by_itself, plain = ((cheap,), True), ((dear,), True), ((dear,), True), ((dear,), False)
    assert found(1, 1, 0) == ((drawn.KILLED, 2, dear), [first, second, by_itself, plain])
    assert found(0) == ((drawn.SURVIVED, 2, ""), [first, second])
    for ends in ((1, 0), (1, 1, 1), (sample.OUT_OF_TIME,), (1, sample.OUT_OF_TIME)):
        assert found(*ends)[0] == (drawn.SURVIVED, 2, ""), ends
    monkeypatch.setattr(sample, "known_by_form", lambda change: "words of a sentence")
    assert found() == ((drawn.SURVIVED, 1, ""), [first])
