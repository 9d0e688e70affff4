"""Which releases are meant, and what pip is asked for each."""

import pytest

from adapters.engine import EngineError
from adapters.releases import Distribution, Releases, Requirement
from validation.releases import choosing
from validation.releases.choosing import RegistryError, chosen, offered, release

TWO = Releases(
    (Distribution("old-name", "<4"), Distribution("new-name", ">=4")),
    ">=3,<5",
    (Requirement("<3.1", "numpy<2", "built for it"), Requirement(">=4", "helper==1", "it asks for it")),
    withheld={"4.5": "it erases the disk"},
)


def test_renamed_distributions_are_one_engine():
    assert [release("e", TWO, v).distribution for v in ("3.0", "3.9", "4.0", "4.1")] == [
        *["old-name"] * 2,
        *["new-name"] * 2,
    ]


def test_numpy_is_always_asked_for_once():
    assert release("e", TWO, "3.0").requirements == ("old-name==3.0", "numpy<2")
    assert release("e", TWO, "3.2").requirements == ("old-name==3.2", "numpy")
    assert release("e", TWO, "4.0").requirements == ("new-name==4.0", "helper==1", "numpy")


def test_release_unknown_to_the_adapter_with_the_range():
    assert release("e", TWO, "3.5").unknown == ""
    assert ">=3,<5" in release("e", TWO, "2.9").unknown and "--try" in release("e", TWO, "5.0").unknown
    assert release("e", TWO, "4.5").unknown == "it erases the disk"


def test_named_prerelease_within_the_known_range():
    """It is asked for with all that a release of that number needs; before the first that is known it is not known."""
    found = release("e", TWO, "4.2rc1")
    assert found.requirements == ("new-name==4.2rc1", "helper==1", "numpy") and found.unknown == ""
    for outside in ("3.0rc1", "5.1rc1"):
        assert release("e", TWO, outside).unknown == "its adapter supports >=3,<5; --try runs it all the same"
    assert release("e", TWO, "3.0.5a2").requirements == ("old-name==3.0.5a2", "numpy<2")
    only = Releases((Distribution("name", ">=2"),), ">=2")
    with pytest.raises(EngineError, match=r"^releases: no distribution of e has 1\.9b1$"):
        release("e", only, "1.9b1")


def test_mujoco_release_4_0_0_of_two_distributions():
    assert [r.distribution for r in chosen("mujoco", "3.17.0,4.0.0")] == ["mujoco", "mujoco-core"]


def test_range_with_every_release_of_the_registry(toy):
    assert [r.version for r in chosen("toy", "1.0.0..1.2.0")] == ["1.0.0", "1.1.0", "1.2.0"]
    assert [r.version for r in chosen("toy", "1.1.0..")] == ["1.1.0", "1.2.0", "2.0.0"]
    assert [r.version for r in chosen("toy", "..1.1")] == ["1.0.0", "1.1.0"]
    assert [r.version for r in chosen("toy", "latest")] == ["2.0.0"]
    assert [r.name for r in chosen("toy", "2.0.0, 1.0.0")] == ["toy==1.0.0", "toy==2.0.0"]
    with pytest.raises(EngineError, match=r"has no release in 7\.\.8; it has 1\.0\.0 to 2\.0\.0"):
        chosen("toy", "7..8")


@pytest.mark.parametrize("text", ["", ",", "3.0;rm", "a..b", "1.0.0..--pre", "1.0 2.0", "@x", "1.0..2.0..3.0"])
def test_invalid_version_in_one_line(toy, text):
    with pytest.raises(EngineError, match=r"^releases: [^\n]*$"):
        chosen("toy", text)


def test_commits_in_place_of_releases():
    with pytest.raises(EngineError, match="reference has no releases"):
        chosen("reference", "latest")


@pytest.mark.parametrize(
    ("engine", "distribution", "inside", "outside"),
    [
        ("rapier", "rapier3d", "0.36.0", "0.35.0"),
        ("box2d3", "pyb2d3", "0.6.0", "0.5.6"),
        ("dart", "dartpy", "6.16.2", "6.15.0"),
        ("drake", "drake", "1.51.0", "1.50.0"),
        ("newton", "newton", "1.8.0", "1.7.0"),
    ],
)
def test_releases_of_optional_engines_can_be_chosen(engine, distribution, inside, outside):
    """Drake and Newton have no table of releases: known are those that their extra installs."""
    known, unknown = chosen(engine, f"{inside},{outside}")[::-1]
    assert (known.distribution, known.unknown) == (distribution, "")
    assert unknown.unknown.endswith("--try runs it all the same")


def test_registry_without_an_answer_in_one_line(toy, monkeypatch, tmp_path):
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    offered.cache_clear()
    with pytest.raises(RegistryError, match=r"^releases: [^\n]*toyphysics[^\n]*$"):
        chosen("toy", "1.0.0..2.0.0")
    assert [r.version for r in chosen("toy", "1.0.0")] == ["1.0.0"]  # a list needs no registry


def test_prereleases_are_not_in_a_range(monkeypatch):
    class Asked:
        returncode, stderr = 0, ""
        stdout = "x (1)\nAvailable versions: 2.0.0rc1, 1.1, dead-beef, 1.0\n"

    monkeypatch.setattr(choosing.subprocess, "run", lambda *args, **kwargs: Asked)
    assert [str(version) for version in choosing._listed("x")] == ["1.1", "1.0"]
