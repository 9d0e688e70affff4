"""Proofs of families as they stand in ``families.toml``: read to the last digit, refused by the name of a field."""

import pytest

from adapters.experiment import Experiment
from validation.findings import FindingsError
from validation.findings.files import FAMILIES, read

FAMILY = """
[[family]]
id = "creeps"
profiles = ["default", "tuned"]
scene = "incline"
metrics = ["creep"]
reason = "it is soft"
source = "its manual"
releases = ">=1.0,<2"
"""
CELL = 'cell = { profile = "default", dimension = 3, metric = "creep[1]" }\n'
PROOF = "[[family.proof]]\n" + CELL + "set = { stiff = true }\n"


@pytest.fixture
def proofs(tmp_path):
    def write(*entries):
        (tmp_path / FAMILIES).write_text(FAMILY + "".join(entries))
        return read("nameless", tmp_path).families["creeps"].proofs

    return write


def test_family_without_a_proof(proofs):
    assert proofs() == ()
    (first,) = proofs(PROOF, FAMILY.replace("creeps", "slides"), PROOF, PROOF)
    assert first.family == "creeps"


def test_proof_defaults_of_the_quick_suite_and_reason(proofs):
    own = Experiment("creeps", "it is soft", "default", "incline", "creep[1]", {"stiff": True}, dimension=3)
    assert proofs(PROOF) == (own,)


def test_all_fields_of_a_proof_with_their_types(proofs):
    (proof,) = proofs(
        "[[family.proof]]\n"
        'cell = { profile = "tuned", dimension = 2, metric = "creep", params = { e = 1, mu = 0.1 }, iterations = 4, '
        'dt = "1/480" }\n'
        'set = { friction = "none", solref = [0.0, -239.976], rounds = 3, slop = 1e-7, cone = "round" }\n'
        "not = [{ rounds = 3 }, { slop = 0.0 }]\n"
        "within = 1\n"
    )
    off = {"friction": None, "solref": (0.0, -239.976), "rounds": 3, "slop": 1e-7, "cone": "round"}
    assert proof == Experiment(
        "creeps", "it is soft", "tuned", "incline", "creep", off, {"e": 1.0, "mu": 0.1}, 2, 4,
        ({"rounds": 3}, {"slop": 0.0}), 1.0, 1 / 480,
    )  # fmt: skip
    assert [type(value) for value in (*proof.params.values(), proof.off["rounds"], proof.within)] == [
        float, float, int, float
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ('proof = "no table"\n', "proof must be a list of tables, [[family.proof]]"),
        ("proof = [1]\n", "proof must be a table"),
        (PROOF.replace("set", "off"), "proof: off is not a field; fields are cell, set, not, within"),
        (PROOF.replace("set = { stiff = true }\n", ""), "proof: set is missing"),
        (PROOF.replace(CELL, ""), "proof: cell is missing"),
        (PROOF.replace("{ stiff = true }", "{}"), "proof: set must be a table of settings"),
        (PROOF + "not = { a = 1 }\n", "proof: not must be a list of tables of settings"),
        (PROOF + "not = [{}]\n", "proof: not must be a list of tables of settings"),
        (PROOF + "not = [{ stiff = true }]\n", "proof: not: the same settings as in set"),
        (PROOF + "within = 0.0\n", "proof: within must be a number above 0"),
        (PROOF + "within = true\n", "proof: within must be a number above 0"),
        (PROOF.replace(", dimension = 3", ""), "proof: cell: dimension is missing"),
        (PROOF.replace("3", "4"), "proof: cell: dimension must be 2 or 3"),
        (PROOF.replace("3", "true"), "proof: cell: dimension must be 2 or 3"),
        (PROOF.replace('"default"', "7"), "proof: cell: profile must be a name"),
        (PROOF.replace('"default"', '"soft"'), "proof: cell: the family does not cover soft creep[1]"),
        (PROOF.replace("creep", "drift"), "proof: cell: the family does not cover default drift[1]"),
        (PROOF.replace(" }", ", scene = 1 }", 1),
         "proof: cell: scene is not a field; fields are profile, dimension, metric, params, iterations, dt"),
        (PROOF.replace(" }", ", params = { e = true } }", 1), "proof: cell: params must be a table of numbers"),
        (PROOF.replace(" }", ", iterations = 0 }", 1), "proof: cell: iterations must be a whole number above 0"),
        (PROOF.replace(" }", ", iterations = 1.5 }", 1), "proof: cell: iterations must be a whole number above 0"),
        (PROOF.replace(" }", ", dt = 0.01 }", 1), 'proof: cell: dt must be a step in words, "1/480"'),
        (PROOF.replace(" }", ', dt = "soon" }', 1),
         "proof: cell: dt: 'soon' is not a number of seconds such as 1/240 or 0.004"),
        (PROOF.replace(" }", ', dt = "-1/2" }', 1),
         "proof: cell: dt: -1/2 must be a positive, finite number of seconds"),
        (PROOF + '"\\u001b[31mred" = 1\n', "proof: \\u{1b}[31mred is not a field; fields are cell, set, not, within"),
    ],
)  # fmt: skip
def test_wrong_proof_refused_by_family_and_field(proofs, tmp_path, entry, said):
    with pytest.raises(FindingsError) as caught:
        proofs(entry)
    assert str(caught.value) == f"{tmp_path / FAMILIES}: family creeps: {said}"


MANY = FAMILY.replace('scene = "incline"', 'scenes = ["incline", "stack"]')


def test_one_entry_for_several_scenes(tmp_path):
    """It is a family for each scene, with the proofs whose cells name it."""
    (tmp_path / FAMILIES).write_text(MANY + PROOF.replace("{ profile", '{ scene = "stack", profile'))
    found = read("nameless", tmp_path).families
    assert {name: (family.scene, family.reason) for name, family in found.items()} == {
        "incline-creeps": ("incline", "it is soft"), "stack-creeps": ("stack", "it is soft")
    }  # fmt: skip
    assert found["incline-creeps"].proofs == ()
    (proof,) = found["stack-creeps"].proofs
    assert (proof.family, proof.scene, proof.metric) == ("stack-creeps", "stack", "creep[1]")


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (MANY + PROOF, "creeps: proof: cell: scene must be one of incline, stack"),
        (MANY.replace('["incline", "stack"]', "[]"), "creeps: scenes must be a list of names"),
        (MANY + 'scene = "stack"\n', "creeps: scenes must be a list of names, in place of scene"),
        (MANY + "proof = 1\n", "creeps: proof must be a list of tables"),
    ],
)
def test_wrong_entry_for_several_scenes(tmp_path, entry, said):
    (tmp_path / FAMILIES).write_text(entry)
    with pytest.raises(FindingsError) as caught:
        read("nameless", tmp_path)
    assert said in str(caught.value) and "\n" not in str(caught.value)
