"""Findings: every member has a value, a band and a family with a reason; nothing wider is read from a file."""

from dataclasses import replace
from importlib.metadata import EntryPoint

import pytest
from packaging.specifiers import SpecifierSet

from adapters import registry
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, parse_dt, plane_of
from validation.findings import Family, Finding, FindingsError, Known, Unsupported, files, known_of, row_key
from validation.judging.rows import rows_of
from validation.running.plan import is_standard

ENGINES = [name for name in registry.names() if registry.is_ours(registry.entry(name))]
SLOT = Slot("incline", (("ratio", 0.99),), 2, "nameless", "default", 1 / 240)
FAMILY = """
[[family]]
id = "creeps"
profiles = ["default"]
scene = "incline"
metrics = ["creep"]
reason = "it is soft"
source = "its manual"
releases = ">=1.0,<2"
"""
UNSUPPORTED = """
[[unsupported]]
id = "planar"
profiles = ["*"]
scene = "*"
dimension = 3
reason = "it is planar"
source = "its manual"
"""
HEAD = ",".join(files.COLUMNS) + "\n"
MEMBER = "creeps,default,2,ratio=0.99,1/240,,creep,0.5,1e-3\n"


@pytest.fixture
def findings(tmp_path, monkeypatch):
    """Write the findings of the engine `nameless`, and let them be found."""

    def write(families=FAMILY, members=HEAD + MEMBER):
        folder = tmp_path / "nameless"
        folder.mkdir(exist_ok=True)
        (folder / files.FAMILIES).write_text(families)
        (folder / files.MEMBERS).write_text(members)
        files.findings_of.cache_clear()
        return folder

    monkeypatch.setattr(files, "findings_folder", lambda engine: tmp_path / engine)
    yield write
    files.findings_of.cache_clear()


def observed(slot, version="1.2", outcome=Outcome.OK, **metrics):
    values = {name: (value, "") for name, value in metrics.items()}
    return Observation(slot, "cell", 1, version, outcome, metrics=values)


def judged(slot, version="1.2", outcome=Outcome.OK, **metrics):
    (row,) = rows_of("run", [observed(slot, version, outcome, **metrics)])
    return row.physics, row.standing, row.alarming


# ---- what is committed ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_findings_of_every_engine(engine):
    findings = files.findings_of(engine)
    if findings is None:  # unlisted, which only an engine that is set apart may be
        assert registry.facts(engine).apart
        return
    for family in findings.families.values():
        assert len(family.reason) > 20 and family.source
        assert SpecifierSet(family.releases)


def slot_of(engine, key):
    profile, scene, dimension, params, dt, iterations, _ = key
    given = tuple((name, float(value)) for name, value in (pair.split("=") for pair in params.split()))
    return Slot(scene, given, int(dimension), engine, profile, parse_dt(dt), int(iterations) if iterations else None)


@pytest.mark.parametrize("engine", ENGINES)
def test_members_in_the_quick_suite(engine):
    findings = files.findings_of(engine)
    quick = {
        (name, canonical.minimal(variation.params), dimension, count)
        for name, canonical in CATALOGUE.items()
        for variation in canonical.variations("quick")
        for dimension in canonical.dimensions if variation.runs_in(dimension)
        for count in variation.iterations
    }  # fmt: skip
    met = {}
    for key in findings.members if findings else ():
        slot, cause = slot_of(engine, key), findings.family_of(key).reason  # one of several scenes may be met in one
        met[cause] = met.get(cause, False) or (slot.scene, slot.params, slot.dimension, slot.iterations) in quick
    assert all(met.values()), [cause for cause, is_met in met.items() if not is_met]


@pytest.mark.parametrize("engine", ENGINES)
def test_members_in_the_standard_suite(engine):
    findings = files.findings_of(engine)
    for key in findings.members if findings else ():
        slot, metric = slot_of(engine, key), key[6]
        assert is_standard(slot), key
        canonical = CATALOGUE[slot.scene]
        made = canonical.scene(slot.dimension, dict(slot.params))
        checks = [*canonical.checks(made, slot.dt), *plane_of(canonical, made, slot.dt)]
        stated = {check.metric for check in checks}
        assert metric in stated | {study.name for study in canonical.studies}, key


# ---- what a row's standing is --------------------------------------------------------------------------------------


def test_listed_row_within_and_outside_its_band(findings):
    findings()
    assert judged(SLOT, creep=0.5005) == ("fail", "known", False)
    assert judged(SLOT, creep=0.502) == ("fail", "drifted", True)
    assert judged(SLOT, creep=0.498) == ("fail", "drifted", True)
    assert judged(SLOT, creep=0.0) == ("pass", "drifted", True)


def test_unlisted_failure_is_new_despite_a_family(findings):
    findings(members=HEAD)
    assert judged(SLOT, creep=0.5) == ("fail", "new", True)


def test_finding_of_a_check_without_a_value(findings):
    findings(members=HEAD)
    assert judged(SLOT, creep=None) == (None, "new", True)
    findings(members=HEAD + "creeps,default,2,ratio=0.99,1/240,,creep,,\n")
    assert judged(SLOT, creep=None) == (None, "known", False)
    assert judged(SLOT, creep=0.0) == ("pass", "drifted", True)


def test_finding_of_a_divergence(findings):
    findings()
    assert judged(SLOT, outcome=Outcome.DIVERGED) == ("fail", "drifted", True)
    findings(members=HEAD + "creeps,default,2,ratio=0.99,1/240,,creep,diverged,\n")
    assert judged(SLOT, outcome=Outcome.DIVERGED) == ("fail", "known", False)
    assert judged(SLOT, creep=0.5) == ("fail", "drifted", True)


def test_releases_of_a_family(findings):
    findings()
    assert judged(SLOT, "2.0", creep=0.5) == ("fail", "new", True)
    assert judged(SLOT, "not a version", creep=0.5) == ("fail", "new", True)
    assert judged(SLOT, "1.9.1+5f3a", creep=0.5) == ("fail", "known", False)


def test_family_without_standing_outside_the_standard_suite(findings):
    findings()
    outside = replace(SLOT, dt=1 / 1000)
    assert judged(outside, creep=0.5) == ("fail", None, False)
    assert judged(outside, creep=0.0) == ("pass", None, False)
    assert judged(replace(outside, profile="other"), creep=0.5) == ("fail", "new", True)
    assert "it is soft" in known_of(outside, "creep", "1.2", files.findings_of("nameless")).remark


def test_unsupported_cells_must_be_known_ones(findings):
    findings(families=UNSUPPORTED, members=HEAD)
    spatial = replace(SLOT, dimension=3)
    assert judged(spatial, outcome=Outcome.UNSUPPORTED) == (None, "known", False)
    assert judged(SLOT, outcome=Outcome.UNSUPPORTED) == (None, "new", True)


def test_an_engine_without_findings_is_unlisted(findings):
    assert judged(SLOT, creep=0.5) == ("fail", None, False)
    assert judged(SLOT) == (None, None, False)


@pytest.mark.parametrize("outcome", ["invalid", "crashed", "timed_out", "missing"])
def test_alarm_for_a_listed_cell_without_an_answer(findings, outcome):
    findings()
    assert judged(SLOT, outcome=Outcome(outcome), creep=0.5) == (None, None, True)


def test_alarm_for_a_planned_cell_without_an_observation(findings):
    findings()
    other = replace(SLOT, params=(("ratio", 0.9),))
    rows = rows_of("run", [observed(other, creep=0.0)], [other, SLOT])
    assert [(row.outcome, row.metric, row.alarming) for row in rows] == [
        ("ok", "creep", False), ("missing", "creep", True)]  # fmt: skip


# ---- what a file may say -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("families", "members", "said"),
    [
        (FAMILY.replace('["default"]', '["*"]').replace('["creep"]', '["*"]'), HEAD, "name profiles or metrics"),
        (FAMILY.replace('"incline"', '"*"'), HEAD, "scene must be the name of one scene"),
        (FAMILY.replace('"it is soft"', '" "'), HEAD, "reason is missing"),
        (FAMILY.replace('source = "its manual"\n', ""), HEAD, "source is missing"),
        (FAMILY.replace(">=1.0,<2", "about 1"), HEAD, "no version specifier"),
        (FAMILY.replace("releases", "release"), HEAD, "release is not a field"),
        (FAMILY.replace('["creep"]', '"creep"'), HEAD, "metrics must be a list of names"),
        (FAMILY + FAMILY, HEAD, "family creeps is listed twice"),
        ("[[family", HEAD, "families.toml"),
        (UNSUPPORTED.replace("3", "4"), HEAD, "dimension must be 2 or 3"),
        (FAMILY, "a,b\n", "the first line must be"),
        (FAMILY, HEAD + MEMBER + MEMBER, "is listed twice"),
        (FAMILY, HEAD + MEMBER.replace("creeps", "slides"), "there is no family 'slides'"),
        (FAMILY, HEAD + MEMBER.replace("default", "tuned"), "does not cover tuned creep"),
        (FAMILY, HEAD + MEMBER.replace(",creep,", ",acceleration,"), "does not cover default acceleration"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", ""), "must be numbers"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "inf"), "must be finite"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0.4.."), "must be numbers"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0.4..0.6..0.7"), "must be numbers"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0.4..inf"), "must be finite"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0.51..0.6"), "between the ends of its band"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0.5..0.5"), "between the ends of its band"),
        (FAMILY, HEAD + MEMBER.replace("1e-3", "0"), "the band above 0"),
        (FAMILY, HEAD + "creeps,default\n", "has 2 fields"),
    ],
)
def test_refusal_of_a_wrong_file_by_entry(findings, families, members, said):
    folder = findings(families, members)
    with pytest.raises(FindingsError) as caught:
        files.read("nameless", folder)
    assert said in str(caught.value) and "\n" not in str(caught.value)


MORE_UNSUPPORTED = UNSUPPORTED.replace('id = "planar"', 'id = "again"')


@pytest.mark.parametrize(
    ("families", "members", "said"),
    [
        (FAMILY.replace("releases", "release"), HEAD,
         "{families}: family creeps: release is not a field; fields are id, profiles, scene, metrics, reason, source, "
         "releases"),
        (FAMILY.replace('id = "creeps"', ""), HEAD, "{families}: family ?: id is missing"),
        (FAMILY.replace('["creep"]', "[]"), HEAD,
         "{families}: family creeps: metrics must be a list of names"),
        (FAMILY.replace('["creep"]', "[1]"), HEAD,
         "{families}: family creeps: metrics must be a list of names"),
        (FAMILY.replace('"incline"', '"*"'), HEAD, "{families}: family creeps: scene must be the name of one scene"),
        (FAMILY + FAMILY, HEAD, "{families}: family creeps is listed twice"),
        (UNSUPPORTED.replace("3", "1"), HEAD,
         "{families}: unsupported planar: dimension must be 2 or 3, or missing for both"),
        (MORE_UNSUPPORTED.replace('"it is planar"', "7"), HEAD, "{families}: unsupported again: reason must be a text"),
        (UNSUPPORTED + 'params = { far = "far" }\n', HEAD,
         "{families}: unsupported planar: params must be a table of numbers"),
        (FAMILY, "a,b\n", "{members}: the first line must be "
         "family,profile,dimension,params,dt,iterations,metric,value,band"),
        (FAMILY, HEAD + MEMBER + MEMBER, "{members}:3: default incline 2 ratio=0.99 1/240  creep is listed twice"),
        (FAMILY, HEAD + "creeps,default\n", "{members}:2: has 2 fields, not 9"),
        (FAMILY, HEAD + MEMBER + MEMBER.replace("creeps", "slides"), "{members}:3: there is no family 'slides'"),
        (FAMILY, HEAD + MEMBER.replace("0.5", "half"),
         "{members}:2: value 'half' and band '1e-3' must be numbers"),
        (FAMILY, HEAD + MEMBER.replace("0.5", "nan"),
         "{members}:2: value nan and band 1e-3 must be finite, the band above 0"),
    ],
)  # fmt: skip
def test_wrong_finding_told_with_file_and_line_or_entry(findings, families, members, said):
    folder = findings(families, members)
    with pytest.raises(FindingsError) as caught:
        files.read("nameless", folder)
    assert str(caught.value) == said.format(families=folder / files.FAMILIES, members=folder / files.MEMBERS)


@pytest.mark.parametrize("name", [files.FAMILIES, files.MEMBERS])
def test_refusal_of_a_file_that_is_no_utf_8(findings, name):
    folder = findings()
    (folder / name).write_bytes(b"\xff\xfe" + "µ".encode("utf-16-le"))
    with pytest.raises(FindingsError, match=rf"^.*{name}: .*codec"):
        files.read("nameless", folder)


def test_families_without_members_are_findings_of_their_engine(findings):
    folder = findings(FAMILY + UNSUPPORTED.replace("dimension = 3\n", "") + MORE_UNSUPPORTED.replace("3", "2"))
    (folder / files.MEMBERS).unlink()
    found = files.read("nameless", folder)
    assert (found.engine, list(found.families), found.members) == ("nameless", ["creeps"], {})
    assert [(entry.id, entry.dimension) for entry in found.unsupported] == [("planar", 0), ("again", 2)]


def test_parameters_of_an_unsupported_entry_in_name_order(findings):
    (entry,) = files.read("nameless", findings(UNSUPPORTED + "params = { n = 2, far = 1e8 }\n", HEAD)).unsupported
    assert entry.params == (("far", 1e8), ("n", 2.0)) and all(type(value) is float for _, value in entry.params)


@pytest.mark.parametrize("profiles", ['["reference"]', '["classical", "reference"]'])
def test_solver_profile_rows_not_listed_by_hand(findings, profiles):
    folder = findings(FAMILY.replace('["default"]', profiles), HEAD)
    with pytest.raises(FindingsError, match="never listed"):
        files.read("reference", folder)
    folder = findings(FAMILY.replace('["default"]', '["*"]'), HEAD + MEMBER.replace("default", "reference"))
    with pytest.raises(FindingsError, match="never listed"):
        files.read("reference", folder)


def test_written_values_read_again(findings):
    folder = findings()
    family = files.read("nameless", folder).families["creeps"]
    members = {
        row_key(replace(SLOT, iterations=n), "creep"): Finding(family, value, band)
        for n, (value, band) in enumerate([(1.23456789e-5, 1e-9), (-0.98765, 1e-2), (1e6, 3.0), (0.0, 1e-12)], start=1)
    } | {row_key(SLOT, "creep"): Finding(family, None, diverged=True)}
    members[row_key(replace(SLOT, dimension=3), "creep")] = Finding(family, None)
    files.write_members(folder, members)
    again = files.read("nameless", folder).members
    assert again.keys() == members.keys()
    for key, finding in members.items():
        assert again[key].diverged == finding.diverged
        if finding.value is None:
            assert again[key].value is None
        else:
            assert abs(again[key].value - finding.value) <= 0.05 * finding.band
            assert again[key].band == pytest.approx(finding.band, rel=0.05)


def test_band_with_two_ends(findings):
    (found,) = files.read("nameless", findings(FAMILY, HEAD + MEMBER.replace("1e-3", "0.45..6e-1"))).members.values()
    assert (found.value, found.ends) == (0.5, (0.45, 0.6))
    assert [found.holds(value) for value in (0.449, 0.45, 0.6, 0.601, float("nan"))] == [
        False,
        True,
        True,
        False,
        False,
    ]
    assert found.band_text == "0.5, from 0.45 to 0.6"
    assert replace(found, ends=None, band=0.1).band_text == "0.5 +- 0.1"
    assert not replace(found, value=None).holds(0.5)


@pytest.mark.parametrize(
    ("value", "ends", "text"),
    [
        (0.0096432, (0.0071349, 0.0151123), "0.0096,0.007..0.0153"),
        (-0.0096432, (-0.0151123, -0.0071349), "-0.0096,-0.0153..-0.007"),
        (3.0, (2.99901, 3.00099), "3,2.999..3.001"),
        (1.23456789, (1.2345, 2.0), "1.23457,1.2..2"),
        (0.0, (0.0, 0.5), "0,0..0.5"),
        (-0.25, (-0.25, 0.996), "-0.2,-0.3..1"),
    ],
)
def test_written_ends_of_a_band(findings, value, ends, text):
    folder = findings()
    family = files.read("nameless", folder).families["creeps"]
    files.write_members(folder, {row_key(SLOT, "creep"): Finding(family, value, ends=ends)})
    assert (folder / files.MEMBERS).read_text().splitlines()[1].partition(",creep,")[2] == text
    (again,) = files.read("nameless", folder).members.values()
    wide = 1.11 * (ends[1] - ends[0])
    assert again.ends[0] <= ends[0] < ends[1] <= again.ends[1] <= again.ends[0] + wide and again.holds(value)


def test_added_family_read_again(findings):
    folder = findings()
    family = Family("quoted", ("a", "b"), "stack", ("drift",), 'it "slips" \\ \t by 3 µm', "its manual", "==1.*")
    files.add_entries(folder, [family])
    assert files.read("nameless", folder).families["quoted"] == family


@pytest.mark.parametrize(
    ("value", "band", "text"),
    [(0.3, 1e-3, "0.3"), (123.4, 600.0, "1e+02"), (0.1234567890123456, 1e-16, "0.1234567890123456"),
     (0.75, 1.1, "0.8"), (0.1, 1e-20, "0.1")],
)  # fmt: skip
def test_digits_of_values_by_their_band(findings, value, band, text):
    folder = findings()
    family = files.read("nameless", folder).families["creeps"]
    files.write_members(folder, {row_key(SLOT, "creep"): Finding(family, value, band)})
    assert (folder / files.MEMBERS).read_text().splitlines()[1].split(",")[7] == text


def test_written_lines_of_members(findings):
    folder = findings()
    family = files.read("nameless", folder).families["creeps"]
    members = {row_key(replace(SLOT, params=(("ratio", r),)), "creep"): Finding(family, None) for r in (0.9, 0.5)}
    members[row_key(replace(SLOT, iterations=20), "creep")] = Finding(family, 0.25, 0.125)
    files.write_members(folder, members)
    assert (folder / files.MEMBERS).read_bytes().decode() == (
        HEAD + "creeps,default,2,ratio=0.5,1/240,,creep,,\ncreeps,default,2,ratio=0.9,1/240,,creep,,\n"
        "creeps,default,2,ratio=0.99,1/240,20,creep,0.25,1.2e-01\n"
    )


@pytest.mark.parametrize("engine", [name for name in ENGINES if files.findings_of(name) is not None])
def test_digits_of_members_written_again(engine, tmp_path):
    before = (files.findings_folder(engine) / files.MEMBERS).read_bytes()
    files.write_members(tmp_path, files.findings_of(engine).members)
    assert (tmp_path / files.MEMBERS).read_bytes() == before


def test_families_are_appended_in_words_that_people_read(tmp_path):
    folder = tmp_path / "not" / "there yet"
    family = Family("soft", ("a", "b"), "stack", ("drift",), "sinks 3 µm \x7f", "its manual", "==1.*")
    files.add_entries(folder, [])
    assert not folder.exists()
    files.add_entries(folder, [family])
    files.add_entries(folder, [replace(family, id="softer"), replace(family, id="softest")])
    blocks = (folder / files.FAMILIES).read_bytes().decode("utf-8").split("\n\n")
    assert [block.strip().splitlines() for block in blocks] == [
        ["[[family]]", f'id = "{name}"', 'profiles = ["a", "b"]', 'scene = "stack"', 'metrics = ["drift"]',
         'reason = "sinks 3 µm \\u007f"', 'source = "its manual"', 'releases = "==1.*"']
        for name in ("soft", "softer", "softest")]  # fmt: skip
    assert files.read("nameless", folder).families["softest"].reason == family.reason


# ---- what is known of a row ----------------------------------------------------------------------------------------


def test_known_facts_and_text_of_a_row(findings):
    findings()
    own = files.findings_of("nameless")
    listed = Finding(own.families["creeps"], 0.5, 1e-3)
    outside = replace(SLOT, dt=1 / 1000)
    assert known_of(SLOT, "creep", "1.2", None) == Known(None, False, "the engine has no list of findings")
    assert known_of(SLOT, "creep", "1.2", own) == Known(listed, True)
    assert known_of(SLOT, "creep", "2.0", own) == Known(None, True, "listed for releases >=1.0,<2 only: it is soft")
    said = "outside the standard suite, not listed; rows like it: it is soft"
    assert known_of(outside, "creep", "1.2", own) == Known(None, False, said)
    assert known_of(outside, "creep", "2.0", own) == Known(None, True)
    assert known_of(replace(SLOT, iterations=None, dimension=3), "creep", "1.2", own) == Known(None, True)


def test_a_release_candidate_is_of_its_release():
    family = Family("f", ("*",), "incline", ("creep",), "it is soft", "its manual", ">=1.0,<2")
    assert family.holds_for("1.3rc1") and family.holds_for("1.3.dev4")
    assert not family.holds_for("2.1rc1")


@pytest.mark.parametrize(("iterations", "written"), [(None, ""), (20, "20")])
def test_finding_by_all_that_was_asked(iterations, written):
    key = row_key(replace(SLOT, iterations=iterations), "creep")
    assert key == ("default", "incline", "2", "ratio=0.99", "1/240", written, "creep")
    assert row_key(SLOT, "apex[2]")[-1] == "apex[2]"  # one of several is listed alone


@pytest.mark.parametrize(
    ("entry", "covered"),
    [
        (Unsupported("u", ("*",), "*", 0, "why", "source"), True),
        (Unsupported("u", ("default",), "incline", 2, "why", "source"), True),
        (Unsupported("u", ("tuned",), "*", 0, "why", "source"), False),
        (Unsupported("u", ("*",), "stack", 0, "why", "source"), False),
        (Unsupported("u", ("*",), "*", 3, "why", "source"), False),
        (Unsupported("u", ("*",), "*", 0, "why", "source", SLOT.params), True),
        (Unsupported("u", ("*",), "*", 0, "why", "source", (("ratio", 0.5),)), False),
        (Unsupported("u", ("*",), "*", 0, "why", "source", (("far", 1e8),)), False),
    ],
)
def test_content_of_an_unsupported_entry(entry, covered):
    assert entry.covers(SLOT) is covered


def test_findings_of_an_engine_by_its_registration(monkeypatch):
    ours, theirs = EntryPoint("a", "adapters.a:A", "g"), EntryPoint("b", "elsewhere.b:B", "g")
    monkeypatch.setattr(registry, "_entries", lambda: {"a": ours, "b": theirs})
    assert [files.brought_by_ours(name) for name in ("a", "b", "nobody")] == [True, False, False]


def test_engine_without_a_folder_has_no_findings_file(monkeypatch):
    monkeypatch.setattr(files, "folder_of", lambda engine: None)
    assert files.findings_folder("nameless") is None


@pytest.mark.parametrize(("band", "ends"), [("0.25..0.5", (0.25, 0.5)), ("0.5..0.75", (0.5, 0.75)), ("0.....75", None),
                                            ("0...75", (0.0, 0.75))])  # fmt: skip
def test_band_ends_inclusive_and_split_at_the_first_dots(findings, band, ends):
    folder = findings(FAMILY, HEAD + MEMBER.replace("1e-3", band))
    if ends is None:
        with pytest.raises(FindingsError, match="must be numbers"):
            files.read("nameless", folder)
        return
    (found,) = files.read("nameless", folder).members.values()
    assert found.ends == ends and found.holds(0.5)


def test_shortest_band_end_within_its_room():
    assert files._outwards(1.5, 1, 0.5) == "2" and files._outwards(-1.5, -1, 0.5) == "-2"
    assert files._outwards(1.5, 1, 0.49) == "1.5"
