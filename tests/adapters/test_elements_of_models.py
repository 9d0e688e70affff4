"""Models as trees of elements: what stays, what is left out or refused at which line, and limits to the last one."""

import pytest

from adapters.model import markup
from adapters.model.markup import Element, named, parsed, text_of
from adapters.mujoco import markup as mjcf
from adapters.plain import NAME
from adapters.scene import SceneError


def read(text, tag="mujoco"):
    return parsed(text, tag, "is no such model")


def refused(call, *given):
    with pytest.raises(SceneError) as error:
        call(*given)
    return str(error.value)


def tags(root):
    return [element.tag for element in root.walk()]


# ---- text and tree ---------------------------------------------------------------------------------------------------


def test_line_text_and_children_of_an_element():
    root = read('<mujoco>\n <body name="a&amp;b">  one\n  two <geom size="1"/> three</body>\n\n<body/></mujoco>')
    assert [(e.tag, e.line, " ".join(e.text.split())) for e in root.walk()] == [
        ("mujoco", 1, ""), ("body", 2, "one two three"), ("geom", 3, ""), ("body", 5, "")]  # fmt: skip
    assert root.children[0].attributes == {"name": "a&b"} and root.children[0].children[0].attributes == {"size": "1"}
    assert [str(e) for e in root.walk()] == [
        "line 1: <mujoco>", "line 2: <body> 'a&b'", "line 3: <geom>", "line 5: <body>"]  # fmt: skip
    assert str(Element("t" * 200, {"name": "n" * 200}, 7)) == str(Element("t" * 300, {"name": "n" * 300}, 7))
    assert str(Element("geom", {"name": "geom@7"}, 7)) == "line 7: <geom>", "a name that we gave is none"


def test_written_tree_read_again():
    text = '<mujoco>\n\n <body name="&lt;&quot;x&quot;&gt;">a  &lt; b<geom/>\n<geom/></body></mujoco>'
    root = read(text)
    again = read(text_of(root))
    assert [(e.tag, e.line, e.attributes) for e in again.walk()] == [(e.tag, e.line, e.attributes) for e in root.walk()]
    assert again.children[0].text.split() == ["a", "<", "b"] and text_of(again) == text_of(root)
    late = Element("mujoco", {}, 3, [Element("body", {}, 1), Element("body", {}, 4)])
    assert text_of(late) == "\n\n<mujoco><body></body>\n<body></body></mujoco>", "none begins before what holds it"


def test_removal_of_a_nested_element_alone():
    root = read("<mujoco><body><geom/><geom/></body><geom/></mujoco>")
    inner = root.children[0].children[1]
    assert root.without(inner) and tags(root) == ["mujoco", "body", "geom", "geom"]
    assert not root.without(inner) and not root.without(root)
    assert root.without(root.children[1]) and tags(root) == ["mujoco", "body", "geom"]


def test_elements_of_one_line_without_a_name_get_different_ones():
    root = read('<mujoco><body/><body/><body name="own"/>\n<body/><geom/><site/></mujoco>')
    named(root, ("body", "geom"))
    assert [e.attributes.get("name") for e in root.children] == [
        "body@1", "body@1-2", "own", "body@2", "geom@2", None]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<!DOCTYPE x>\n<mujoco/>", "model: line 1: document types and entities are not read"),
        ("<mujoco>\n<body>", "model: is not XML: "),
        ("", "model: is not XML: "),
        ("<mujoco/><mujoco/>", "model: is not XML: "),
        ("\n<robot name='r'/>", "model: line 2: <robot> 'r': is no such model"),
        ("<mujoco>\ud800</mujoco>", "model: is not XML: "),
    ],
)
def test_text_that_is_no_model_refused(text, said):
    found = refused(read, text)
    assert found.startswith(said) and "\n" not in found


def test_largest_number_of_elements_and_levels(monkeypatch):
    monkeypatch.setattr(markup, "MOST_ELEMENTS", 4)
    monkeypatch.setattr(markup, "MOST_LEVELS", 3)
    assert len(tags(read("<mujoco><a/><a/><a/></mujoco>"))) == 4
    assert len(tags(read("<mujoco><a><b/></a></mujoco>"))) == 3
    words = "more than 4 elements, or nested deeper than 3"
    assert refused(read, "<mujoco><a/><a/>\n<a/><a/></mujoco>") == f"model: line 2: <a>: {words}"
    assert refused(read, "<mujoco><a><b>\n<c/></b></a></mujoco>") == f"model: line 2: <c>: {words}"


# ---- MJCF ------------------------------------------------------------------------------------------------------------


def clean(text, drop=False):
    root = read(f"<mujoco>{text}</mujoco>")
    return root, mjcf.cleaned(root, drop)


def test_visual_and_sensor_elements_dropped_silently():
    silent = "".join(f"<{tag}><deep/></{tag}>" for tag in sorted(mjcf.SILENT))
    geom = '<geom name="g" rgba="1" material="m" user="1" group="2" size="1"/>'
    root, dropped = clean(f"{silent}<worldbody>{silent}{geom}</worldbody>")
    assert tags(root) == ["mujoco", "worldbody", "geom"] and dropped == []
    assert root.children[0].children[0].attributes == {"name": "g", "size": "1"}


@pytest.mark.parametrize("tag", sorted(set(mjcf.NO_PLACE) - {"mesh"}))
def test_unsupported_elements(tag):
    line = f"line 1: <{tag}>: {mjcf.NO_PLACE[tag]}"
    assert refused(clean, f"<{tag}/>") == f"model: {line}"
    root, dropped = clean(f'<{tag}/><worldbody><body name="kept"/></worldbody>', drop=True)
    assert dropped == [line] and tags(root) == ["mujoco", "worldbody", "body"]


def test_unknown_element_refused_unless_in_a_default():
    assert refused(clean, "<odd/>") == "model: line 1: <odd>: a scene has no such element"
    assert clean("<odd/>", drop=True)[1] == ["line 1: <odd>: a scene has no such element"]
    root, dropped = clean(
        "<default><odd/><tendon/><geom/><pair/><joint/><mesh/><default><odd/><geom/></default></default>"
    )
    assert dropped == [] and tags(root) == ["mujoco", "default", "geom", "pair", "joint", "mesh", "default", "geom"]


@pytest.mark.parametrize("tag", sorted(mjcf.FOREIGN))
def test_references_outside_the_text_always_refused(tag):
    for drop in (False, True):
        assert refused(clean, f"<worldbody><{tag}/></worldbody>", drop) == (
            f"model: line 1: <{tag}>: {mjcf.FOREIGN[tag]}"
        )


def test_mesh_kept_only_as_the_hull_of_its_vertices():
    root, dropped = clean('<asset><mesh name="m" vertex="0 0 0" scale="1 1 1" class="c"/></asset>')
    assert tags(root) == ["mujoco", "asset", "mesh"] and dropped == []
    no_hull = f"line 1: <mesh>: {mjcf.NO_PLACE['mesh']}"
    assert clean("<asset><mesh/></asset>", drop=True)[1] == [no_hull]
    assert clean('<asset><mesh vertex="0" smoothnormal="true" inertia="x"/></asset>', drop=True)[1] == [
        f"line 1: <mesh>: inertia: {mjcf.NO_PLACE['mesh']}"]  # fmt: skip
    assert clean('<asset><mesh file="a.stl"/><hfield file="b"/></asset>', drop=True)[1] == [
        "line 1: <mesh>: other files are not read", "line 1: <hfield>: other files are not read"]  # fmt: skip
    assert clean('<default><mesh scale="2 2 2"/></default>')[1] == []
    assert clean('<default><mesh inertia="x"/></default>', drop=True)[1] == [
        f"line 1: <mesh>: inertia: {mjcf.NO_PLACE['mesh']}"]  # fmt: skip


@pytest.mark.parametrize(
    "call", [clean, lambda text: mjcf.rid_of(read(f"<mujoco>{text}</mujoco>"), False, ("body",), (), {})]
)
def test_length_and_visibility_of_a_name(call):
    call(f'<body name="{"n" * (NAME - 4)}"/>')
    assert refused(call, f'<body name="{"n" * (NAME - 3)}"/>') == f"model: line 1: '{'n' * 36} ...' cannot be a name"
    assert refused(call, '<body name="&#8203;"/>').endswith("cannot be a name")


def test_bodies_and_geoms_named_only_in_the_world():
    root, _ = clean("<default><geom/></default><worldbody><body><geom/></body></worldbody>")
    assert "name" not in root.children[0].children[0].attributes
    assert [e.attributes.get("name") for e in root.children[1].walk()] == [None, "body@1", "geom@1"]


def test_copies_are_counted_before_they_are_made(monkeypatch):
    monkeypatch.setattr(mjcf, "MOST_MADE", 6)
    six = '<worldbody><replicate count="3"><body><geom/></body></replicate></worldbody>'
    clean(six)
    words = "bodies and geoms are more than the 6 that are read"
    assert refused(clean, six.replace('"3"', '"3.5"')) == f"model: 7 {words}"
    assert refused(clean, f"{six}<worldbody><body/></worldbody>") == f"model: 7 {words}"
    twice = '<worldbody><replicate count="2"><replicate count="2"><body/></replicate><geom/></replicate></worldbody>'
    clean(twice)
    assert refused(clean, twice.replace("<geom/>", "<geom/><geom/>")) == f"model: 8 {words}"
    clean('<worldbody><replicate count="-9"><body/></replicate><replicate><body/></replicate></worldbody>')
    assert refused(clean, '<worldbody>\n<replicate count="many"/></worldbody>') == (
        "model: line 2: <replicate>: count is not a number"
    )


# ---- other languages -------------------------------------------------------------------------------------------------


def test_elements_of_another_language_kept_dropped_or_refused():
    text = '<robot><link name="a"><visual/><odd/><collision><odd/></collision></link><joint/></robot>'

    def rid(drop):
        root = read(text, "robot")
        return root, mjcf.rid_of(root, drop, ("link", "collision"), ("visual",), {"joint": "nothing is held"})

    assert refused(rid, False) == "model: line 1: <joint>: nothing is held"
    root, dropped = rid(True)
    assert tags(root) == ["robot", "link", "collision"]
    odd = "line 1: <odd>: a scene has no such element"
    assert dropped == ["line 1: <joint>: nothing is held", odd, odd]


def test_limit_on_links_and_their_shapes(monkeypatch):
    monkeypatch.setattr(mjcf, "MOST_MADE", 3)

    def rid(text):
        return mjcf.rid_of(read(f"<robot>{text}</robot>", "robot"), False, ("link", "collision", "origin"), (), {})

    assert rid("<link><collision/></link><link><origin/></link>") == []
    assert refused(rid, "<link><collision/></link><link><collision/></link>") == (
        "model: 4 links and their shapes are more than the 3 that are read"
    )
