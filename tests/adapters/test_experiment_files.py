"""``tuning.toml`` of an engine's folder: what is tried, what belongs together, what is cured; what is wrong with it."""

import pytest

from adapters.engine import EngineError
from adapters.experiment import Cured
from adapters.experiment.files import Tuning, read_tuning


@pytest.fixture
def read(tmp_path):
    def write(text):
        (tmp_path / "tuning.toml").write_text(text)
        return read_tuning(tmp_path / "tuning.toml")

    return write


CURED = '[[cured]]\nshipped = "default"\nbetter = "tuned"\nscene = "stack"\ncells = [{}]\n'


def test_experiment_file_with_parts_missing(read):
    assert read("") == Tuning() == Tuning({}, {}, ())
    assert read('[belongs]\na = "b"\n') == Tuning(belongs={"a": "b"})


def test_order_and_kinds_of_values_read(read):
    found = read(
        '[candidates]\nslop = [0.1, 1]\nref = ["none", [0.5, 1.0]]\ncone = ["a", "b"]\non = [false, true]\n'
        + CURED.replace("[{}]", "[{}, { n = 10, e = 0.5 }]")
        + CURED.replace("stack", "impact")
        + 'metrics = ["creep"]\ndimension = 3\n'
    )
    assert list(found.candidates.items()) == [
        ("slop", (0.1, 1)), ("ref", (None, (0.5, 1.0))), ("cone", ("a", "b")), ("on", (False, True)),
    ]  # fmt: skip
    assert type(found.candidates["slop"][1]) is int
    assert found.cured == (
        Cured("default", "tuned", "stack", ({}, {"n": 10.0, "e": 0.5})),
        Cured("default", "tuned", "impact", ({},), ("creep",), 3),
    )
    assert type(found.cured[0].cells[1]["n"]) is float


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("cured", "Expected '=' after a key in a key/value pair (at end of document)"),
        ("tried = 1\n", "tuning: tried is not a field; fields are candidates, belongs, local, instead, cured, effects"),
        ("candidates = 1\n", "tuning: candidates must be a table"),
        ("[candidates]\nslop = 0.1\n", "candidates: slop must be a list of values"),
        ("[belongs]\nslop = 0.1\n", "belongs: slop must be a name"),
        ("[cured]\n", "tuning: cured must be a list of tables"),
        ("local = [1]\n", "tuning: local must be a list of names"),
        ("[[instead]]\nof = { erp = 0.0 }\n", "instead 1: set is missing"),
        ("cured = [1]\n", "cured 1 must be a table"),
        (CURED + CURED.replace("scene", "scenes"),
         "cured 2: scenes is not a field; fields are shipped, better, scene, cells, metrics, dimension"),
        (CURED.replace('shipped = "default"\n', ""), "cured 1: shipped is missing"),
        (CURED.replace("[{}]", "[]"), "cured 1: cells must be a list of tables of numbers"),
        (CURED.replace("[{}]", '[{ n = "ten" }]'), "cured 1: cells must be a list of tables of numbers"),
        (CURED + "metrics = [1]\n", "cured 1: metrics must be a list of names"),
        (CURED + "dimension = 1\n", "cured 1: dimension must be 2 or 3"),
    ],
)  # fmt: skip
def test_error_line_with_file_and_field(read, tmp_path, text, said):
    with pytest.raises(EngineError) as caught:
        read(text)
    assert str(caught.value) == f"{tmp_path / 'tuning.toml'}: {said}"


def test_refusal_of_a_missing_or_binary_file(tmp_path):
    (tmp_path / "tuning.toml").write_bytes(b"\xff\xfe")
    for path, said in ((tmp_path / "tuning.toml", "codec"), (tmp_path / "none.toml", "No such file")):
        with pytest.raises(EngineError, match=rf"{path.name}: .*{said}"):
            read_tuning(path)
