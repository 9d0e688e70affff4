"""Each check of the kit asks every profile, in the worlds and dimensions it says, and lets none of them go unclosed.

The toy has one profile and lives in space alone, so that a check which forgets a profile or a dimension passes it all
the same. Here it has two, in the plane as well.
"""

import pytest
from listening import SWEEPS, Discs, Dull, Listening

from adapters.conformance import CHECKS
from adapters.conformance.finding import NotAsked
from adapters.conformance.parameters import STEPS, receipt_findings
from adapters.conformance.scenes import DT


def both(steps, *labels):
    """The same in the plane and in space."""
    return {f"{one} {dimension}": steps for one in labels for dimension in (2, 3)}


THROWN = both([72], "glancing light e", "glancing heavy e")
#: Check -> of each scene (name, who stands first, e if it rebounds, box if there is one, dimension) the steps of each
#: of its worlds.
WORLDS = {
    "capabilities": both([0, 48], "striking light e", "flying ball")
    | both([0, 24], "resting floor box", "resting floor")
    | both([0, 12], "pairs a e", "carried piston", "leaning floor box"),
    "states": {"resting floor box 2": [0], "resting box box 2": [0]},
    "readback": {"resting floor box 2": [0]},
    "free_fall": {"flying ball 2": [48]},
    "momentum": THROWN,
    "spin": THROWN,
    "contacts": both([24], "resting floor box", "resting box box"),
    "impulse": both([48], "striking light e", "striking heavy e"),
    "sampling": both([48], "striking light e"),
    "sizes": {f"size floor{box} {d}": [72] * d for box in ("", " box") for d in (2, 3)},
    "moments": {f"moment body{box} {d}": [48] * d for box in ("", " box") for d in (2, 3)},
    "order": {"rolling floor 2": [48], "rolling right 2": [48]},
    "mirror": {"rolling floor 2": [48, 48]},
    "quarter_turn": {"rolling floor 2": [48, 48]},
    # Alone, and in turn with the others.
    "fresh": {"resting floor box 2": [24, 24], "resting box box 2": [24, 24], "striking light e 2": [24, 24]},
    "repeat": {"sliding floor box 2": [48, 48, 48]},
    "history": {"sliding floor box 2": [48, 48, 48], "striking light e 2": [48], "resting box box 2": [24]},
    # At once, one by one, in strides; one step before a recorder and a reader are asked, twice.
    "stride": {"sliding floor box 2": [24, 24, 24, 1, 1, 1, 1]},
}
#: The toy that takes everything but a box on a box builds none of those.
del WORLDS["capabilities"]["leaning floor box 2"], WORLDS["capabilities"]["leaning floor box 3"]
#: The same of an engine without boxes, and of one without rebounds, where that is something else.
WITHOUT_BOXES = {
    "capabilities": {name: made for name, made in WORLDS["capabilities"].items() if "box" not in name},
    "states": {"resting floor 2": [0], "resting ball 2": [0]},
    "readback": {"resting floor 2": [0]},
    "contacts": both([24], "resting floor", "resting ball"),
    "sizes": {f"size floor {d}": [72] * d for d in (2, 3)},
    "moments": {f"moment body {d}": [48] * d for d in (2, 3)},
    "fresh": {"resting floor 2": [24, 24], "resting ball 2": [24, 24], "striking light e 2": [24, 24]},
    "repeat": {"rolling floor 2": [48, 48, 48]},
    "history": {"rolling floor 2": [48, 48, 48], "striking light e 2": [48], "resting ball 2": [24]},
    "stride": {"rolling floor 2": [24, 24, 24, 1, 1, 1, 1]},
}
WITHOUT_REBOUNDS = {
    "capabilities": {name: made for name, made in WORLDS["capabilities"].items() if " e " not in name},
    "momentum": both([72], "glancing light", "glancing heavy"),
    "spin": both([72], "glancing light", "glancing heavy"),
    "impulse": both([48], "striking light", "striking heavy"),
    "sampling": both([48], "striking light"),
    "fresh": {"resting floor box 2": [24, 24], "resting box box 2": [24, 24], "striking light 2": [24, 24]},
    "history": {"sliding floor box 2": [48, 48, 48], "resting box box 2": [24, 24]},
}
ASKED = [
    (kind, check) for kind, known in ((Listening, WORLDS), (Discs, WITHOUT_BOXES), (Dull, WITHOUT_REBOUNDS))
    for check in known
]  # fmt: skip


@pytest.mark.parametrize(("kind", "check"), ASKED)
def test_worlds_that_a_check_builds_per_profile(kind, check):
    engine = kind()
    assert CHECKS[check](engine) == ""
    wanted = {Listening: WORLDS, Discs: WITHOUT_BOXES, Dull: WITHOUT_REBOUNDS}[kind][check]
    for profile in SWEEPS:
        assert engine.worlds(profile) == wanted
    assert {world.dt for world in engine.built} == {DT}
    assert all(world.closed == 1 for world in engine.built)
    assert engine.asked - {""} == set(SWEEPS)


def test_completeness_of_the_list_of_checks():
    """Facts and refusals are no worlds; memory is asked of one profile, and a process tells its bits alone."""
    others = {"packages", "facts", "profiles", "refusals", "bad_numbers", "memory", "process"}
    assert set(WORLDS) == set(CHECKS) - others


def test_invalid_steps_tried_on_each_profile():
    engine = Listening()
    assert CHECKS["bad_numbers"](engine) == CHECKS["refusals"](engine) == CHECKS["profiles"](engine) == ""
    assert engine.built == [] and engine.asked - {""} == set(SWEEPS)


def test_receipts_per_profile_at_both_steps_with_worlds_closed():
    engine = Discs()
    assert [str(each) for each in receipt_findings(engine) if not each.holds] == []
    made = {(world.profile, world.dt, world.scene.dimension) for world in engine.built}
    assert made == {(profile, dt, dimension) for profile in SWEEPS for dt in STEPS for dimension in (2, 3)}
    assert all(world.closed == 1 for world in engine.built)


@pytest.mark.parametrize("check", [*WORLDS, "refusals", "bad_numbers"])
def test_check_with_all_scenes_refused_skipped_with_a_reason(check):
    class Idle(Listening):
        def refuses(self, scene, profile):
            super().refuses(scene, profile)
            return f"not today, {scene.name}"

    with pytest.raises(
        NotAsked, match="^every scene is refused" if check == "capabilities" else "^first: not today, check_"
    ):
        CHECKS[check](Idle())


@pytest.mark.parametrize("check", [name for name in WORLDS if name != "states"])
def test_world_closed_after_any_fault(check):
    """An engine with a licence or a window for each world would run out of them."""

    class Failing(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            world.advance = world.pose = world.twist = world.contacts = world.readback = fail
            return world

    def fail(*asked):
        raise ArithmeticError("no number")

    engine = Failing()
    with pytest.raises(ArithmeticError, match="no number"):
        CHECKS[check](engine)
    assert engine.built and all(world.closed == 1 for world in engine.built)
