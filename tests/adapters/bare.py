"""Models as people have them: a scene on an engine alone, with other names, sizes, masses and step, and lines pasted.

No adapter is used: each function here makes the calls that the engine's own manual shows. Lengths are those of the
scene times `LENGTH`, masses times `MASS`, and times those of the same fall; what comes out is told in the scene's own
units again, so that the scene's own checks judge it, at the step ``STEP / sqrt(LENGTH)``.
"""

from __future__ import annotations

import ast
import copy
import math
import re
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from adapters.engine import Contacts
from adapters.needs import needs
from adapters.scene import Box, Capsule, Disc, HalfSpace, Hull, Sphere
from adapters.scene.drives import velocity_over
from adapters.scene.lift import lift, lower_contacts, lower_pose, lower_twist, out_of_plane
from adapters.scene.shapes import reach
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory
from validation.scenes.sized import enlarged, told_in_units_of

#: Sizes, masses and the step of the models, beside a scene's.
LENGTH, MASS, STEP = 0.3, 0.2, 1.0 / 500.0
#: What is moved from outside outweighs what it moves by so much: its recoil is then far below a check's tolerance. A
#: belt is lighter than a piston: its checks allow more, and MuJoCo ends its iterations by the mean inertia of all.
HEAVY, BELT = 1e15, 1e9
#: Half width and half thickness of a box that stands for the ground [m].
WIDE, THICK = 200.0, 20.0


def run(engine, scene, paste, length=LENGTH, mass=MASS, step=STEP):
    """What a bare engine does with a scene, in the scene's own units; ``paste`` are lines that are pasted into it.

    Returns
    -------
    Trajectory
        With the contacts of every step.
    """
    named = {body.name: f"my_{body.name}" for body in scene.bodies}
    mine = enlarged(scene, length, mass)
    bodies = tuple(replace(body, name=named[body.name]) for body in mine.bodies)
    pairs = tuple(replace(pair, a=named.get(pair.a, "*"), b=named.get(pair.b, "*")) for pair in mine.pairs)
    mine = replace(mine, bodies=bodies, pairs=pairs)
    planar = scene.dimension == 2
    posed = lift(mine) if planar and engine != "chipmunk" else mine
    steps = step_count(mine.duration, step)
    *states, touching = zip(*BARE[engine](posed, step, steps, paste), strict=True)
    pose, twist = (np.array(told, float) for told in states)
    for i, body in enumerate(mine.bodies):  # a belt that moves stands for one that runs where it is
        if any(body.surface_velocity):
            pose[:, i], twist[:, i] = posed.bodies[i].pose, 0.0
    every = [row for rows in touching[1:] for row in rows]
    contacts, outside = Contacts.from_rows(every, posed.dimension), None
    if posed is not mine:
        outside = out_of_plane(pose, np.array([reach(body.shape) for body in mine.bodies])) / length
        pose = np.array([lower_pose(each) for each in pose])
        twist = np.array([lower_twist(each) for each in twist])
        contacts = lower_contacts(contacts) if planar else contacts
    offset = np.cumsum([0, *map(len, touching[1:])])
    record = ContactRecord(np.arange(1, len(pose)), offset, contacts)
    own = Trajectory(step * np.arange(len(pose)), pose, twist, record, step, "completed", out_of_plane=outside)
    return told_in_units_of(own, length, mass)


def motion(body, dt, k):
    """Velocity that something is moved with over a step; of a running surface the one it runs with."""
    return tuple(a + b for a, b in zip(velocity_over(body, dt, k), body.surface_velocity, strict=True))


def is_moved(body):
    return body.motion == "prescribed" or any(body.surface_velocity)


def heavy_of(scene, body):
    """Mass of a body that is moved from outside [kg]."""
    free = max((one.mass for one in scene.bodies if one.motion == "free"), default=1.0)
    return (HEAVY if body.motion == "prescribed" else BELT) * free


def by_product(scene, quantity):
    """A number for each body of which products are those of the pairs: engines that multiply are given such ones."""
    pairs = [(i, j, getattr(material, quantity)) for i, j, material in scene.contact_pairs()]
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    found = np.zeros(len(scene.bodies))
    if len(free) == 1:
        found[free[0]] = 1.0
        for i, j, value in pairs:
            found[i if j == free[0] else j] = value
        return found
    positive = [pair for pair in pairs if pair[2] > 0.0]
    rows = np.zeros((len(positive), len(found)))
    for row, (i, j, _) in zip(rows, positive, strict=True):
        row[[i, j]] = 1.0
    if positive:
        logs = np.linalg.lstsq(rows, np.log([value for *_, value in positive]), rcond=None)[0]
        found = np.where(rows.any(axis=0), np.exp(logs), 0.0)
    return found


# ---- MuJoCo ----------------------------------------------------------------------------------------------------------


def numbers(*values):
    return " ".join(f"{value:.17g}" for value in values)


def mujoco(scene, dt, steps, paste):
    """MJCF as text: a geom for each body; friction of the geoms, or of pairs where they differ."""
    import mujoco as mj

    pasted, names = pasted_mjcf(paste), [body.name for body in scene.bodies]
    pairs = list(scene.contact_pairs())
    frictions = {material.friction for *_, material in pairs}
    named = [one.get("class") for element in pasted if element.tag == "default" for one in element.iter("default")][1:]
    rough = [name for name in named if name != "smooth"]  # as the comments of a paste say
    classes = {"class": (rough if any(frictions) else named)[-1]} if (rough if any(frictions) else named) else {}
    shared = numbers(frictions.pop(), 0.005, 0.0001) if len(frictions) == 1 else None
    assets, bodies, contacts = [], [], []
    for body in scene.bodies:
        shape, x = body.shape, (0.0, 0.0, 0.0)
        turn, extra = (1.0, 0.0, 0.0, 0.0), ""
        if isinstance(shape, HalfSpace):
            turn = turned_to(shape.normal)
            centre = [shape.offset * n for n in shape.normal]
            kind, size = "plane", (0.0, 0.0, 1.0)
            if is_moved(body):
                kind, size = "box", (WIDE, WIDE, THICK)
                centre = [c - THICK * n for c, n in zip(centre, shape.normal, strict=True)]
            x = centre
        elif isinstance(shape, Sphere):
            kind, size = "sphere", (shape.radius,)
        elif isinstance(shape, Box):
            kind, size = "box", shape.half_extents
        elif isinstance(shape, Hull):
            kind, size = "mesh", ()
            corners = numbers(*(c for vertex in shape.vertices for c in vertex))
            assets.append(f'<mesh name="mesh_{body.name}" vertex="{corners}"/>')
            extra = f' mesh="mesh_{body.name}"'
        else:
            kind = "capsule" if isinstance(shape, Capsule) else "cylinder"
            size, turn = (shape.radius, shape.half_length), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
        free = body.motion == "free"
        friction = f' friction="{shared}"' if shared else ""
        friction += f' class="{classes["class"]}"' if classes and free else ""
        geom = f'<geom name="{body.name}" type="{kind}"{extra}{friction} pos="{numbers(*x)}" quat="{numbers(*turn)}"'
        geom += f' size="{numbers(*size)}"' if size else ""
        geom += f' conaffinity="{int(free)}"/>'
        if not (free or is_moved(body)):
            lines = f'<body pos="{numbers(*body.pose[:3])}" quat="{numbers(*body.pose[3:])}">{geom}</body>'
            bodies.append(geom if isinstance(shape, HalfSpace) else lines)
            continue
        heavy = heavy_of(scene, body)
        mass, moments = (body.mass, body.inertia) if free else (heavy, (heavy,) * 3)
        inertial = f'<inertial pos="0 0 0" mass="{mass:.17g}" diaginertia="{numbers(*moments)}"/>'
        place = f'pos="{numbers(*body.pose[:3])}" quat="{numbers(*body.pose[3:])}"'
        weight = "" if free else ' gravcomp="1"'
        bodies.append(f'<body name="{body.name}" {place}{weight}><freejoint/>{inertial}{geom}</body>')
    defaults, options = "", {}
    for element in pasted:
        if element.tag == "default":
            for one in element.iter():
                valued(one, dt=dt, g=needs(scene).pull, e=max(m.restitution for *_, m in pairs))
            defaults += ET.tostring(element, encoding="unicode")
        elif element.tag == "option":
            options |= {name: value for name, value in element.attrib.items() if name != "timestep"}
    for i, j, material in pairs:
        lines = [one for element in pasted if element.tag == "contact" for one in element if fits(one, material)]
        if all(isinstance(scene.bodies[k].shape, HalfSpace) for k in (i, j)) or not (lines or not shared):
            continue
        mu = numbers(material.friction, material.friction, 0.005, 0.0001, 0.0001)
        pair = ET.Element("pair", classes | {"friction": mu})
        for line in map(copy.deepcopy, lines):
            valued(line, dt=dt, g=needs(scene).pull, e=material.restitution)
            pair.attrib |= line.attrib
        pair.attrib |= {"geom1": names[i], "geom2": names[j]}
        contacts.append(ET.tostring(pair, encoding="unicode"))
    options |= {"timestep": f"{dt:.17g}", "gravity": numbers(*scene.gravity)}
    option = " ".join(f'{name}="{value}"' for name, value in options.items())
    text = f"<mujoco><option {option}/>{defaults}<asset>{''.join(assets)}</asset>"
    text += f"<worldbody>{''.join(bodies)}</worldbody><contact>{''.join(contacts)}</contact></mujoco>"
    model = mj.MjModel.from_xml_string(text)
    data = mj.MjData(model)
    places = {}
    for i, body in enumerate(scene.bodies):
        if body.motion == "free" or is_moved(body):
            identity = model.body(body.name).id
            at = model.body_dofadr[identity]
            places[i] = (identity, at, model.body_rootid[identity])
            turn = rotation(body.pose[3:])
            data.qvel[at : at + 6] = (*body.twist[:3], *(turn.T @ body.twist[3:]))
            if body.motion == "free":
                data.xfrc_applied[identity] = (*body.force, *body.torque)

    def state():
        pose, twist = [list(b.pose) for b in scene.bodies], [[0.0] * 6 for _ in scene.bodies]
        for i, (identity, at, _) in places.items():
            joint = model.jnt_qposadr[model.body_jntadr[identity]]
            pose[i] = data.qpos[joint : joint + 7].tolist()
            velocity = data.qvel[at : at + 6]
            twist[i] = [*velocity[:3], *(rotation(pose[i][3:]) @ velocity[3:])]
        force, rows = np.zeros(6), []
        for k, contact in enumerate(data.contact):
            mj.mj_contactForce(model, data, k, force)
            frame = contact.frame.reshape(3, 3)
            rows.append((*geoms[contact.geom], contact.pos.copy(), frame[0], dt * (force[:3] @ frame), contact.dist))
        return pose, twist, rows

    geoms = np.array([names.index(model.geom(k).name) for k in range(model.ngeom)])
    found = [state()]
    for k in range(steps):
        for i, (_, at, _) in places.items():
            if is_moved(scene.bodies[i]):
                data.qvel[at : at + 3] = motion(scene.bodies[i], dt, k)
        mj.mj_step(model, data)
        found.append(state())
    return found


def pasted_mjcf(paste):
    """Elements of MJCF, each with the formulas that the comment before it gives as attribute ``formulas``."""
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    root = ET.fromstring(f"<root>{paste}</root>", parser)

    def read(parent):
        said, kept = "", []
        for element in parent:
            if element.tag is ET.Comment:
                said = element.text
                continue
            read(element)
            if element.tag in ("geom", "pair"):
                element.set("said", said)
            said = ""
            kept.append(element)
        parent[:] = kept
        return kept

    return read(root)


def fits(line, material):
    """Whether a pasted pair is for this material, by its comment."""
    e, mu = (float(found) for found in re.search(r"e = (\S+), friction ([^\s:]+)", line.get("said")).groups())
    return math.isclose(e, material.restitution, rel_tol=1e-5) and math.isclose(mu, material.friction, rel_tol=1e-5)


def valued(element, **known):
    """Replace the numbers that the comment gives formulas for by those of this model."""
    said = element.attrib.pop("said", "")
    for name, formula in re.findall(r'(\w+)="([^"]*)"', said.partition("for others")[2]):
        values = [eval(part.replace("^", "**"), {}, known) for part in formula.split()]
        element.set(name, numbers(*values))


def rotation(quaternion):
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def turned_to(normal):
    """Quaternion (w, x, y, z) of the turn from the z axis to a normal."""
    x, y, z = normal
    return (0.0, 1.0, 0.0, 0.0) if z < -1.0 + 1e-12 else tuple(np.array([1 + z, -y, x, 0.0]) / math.sqrt(2 + 2 * z))


# ---- Bullet ----------------------------------------------------------------------------------------------------------

URDF = """<robot name="{name}"><link name="{name}">
<inertial><mass value="{mass!r}"/>
<inertia ixx="{i[0]!r}" iyy="{i[1]!r}" izz="{i[2]!r}" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin rpy="0 {pitch!r} 0"/><geometry>{shape}</geometry></collision></link></robot>
"""


def bullet(scene, dt, steps, paste):
    """A URDF file for each body, materials by `changeDynamics`, loads before each step."""
    import pybullet
    from pybullet_utils.bullet_client import BulletClient

    p = BulletClient(pybullet.DIRECT)
    lines = [line for line in paste.splitlines() if line.startswith("p.")]
    how = {"flags": p.URDF_USE_INERTIA_FROM_FILE}
    for line in lines:
        if "..." in line:
            for word in ast.parse(line.partition("#")[0].strip()).body[0].value.keywords:
                value = eval(ast.unparse(word.value), {"p": p})
                how[word.arg] = how["flags"] | value if word.arg == "flags" else value
    solved = 0.0 if "contactProcessingThreshold=0.0" in paste else math.inf
    # The threshold is one of the whole process: what another model set must not stay.
    p.setPhysicsEngineParameter(fixedTimeStep=dt, contactBreakingThreshold=0.02)
    p.setGravity(*scene.gravity)
    for line in lines:
        if "setPhysics" in line:
            exec(line, {"p": p})
    bodies, offsets = [], []
    restitution, friction = (by_product(scene, name) for name in ("restitution", "friction"))
    with tempfile.TemporaryDirectory() as folder:
        for k, body in enumerate(scene.bodies):
            shape, pitch, place, turn = body.shape, 0.0, body.pose[:3], body.pose[3:]
            if isinstance(shape, HalfSpace):
                said = f'<box size="{2 * WIDE!r} {2 * WIDE!r} {2 * THICK!r}"/>'
                place, turn = tuple((shape.offset - THICK) * n for n in shape.normal), turned_to(shape.normal)
            elif isinstance(shape, Sphere):
                said = f'<sphere radius="{shape.radius!r}"/>'
            elif isinstance(shape, Box):
                said = '<box size="{!r} {!r} {!r}"/>'.format(*(2.0 * half for half in shape.half_extents))
            elif isinstance(shape, Hull):
                corners = [f"v {x!r} {y!r} {z!r}" for x, y, z in shape.vertices]
                corners += [f"f 1 {n} {n + 1}" for n in range(2, len(corners))]
                Path(folder, f"{k}.obj").write_text("\n".join(corners) + "\n", encoding="ascii")
                said = f'<mesh filename="{k}.obj"/>'
            else:
                kind = "capsule" if isinstance(shape, Capsule) else "cylinder"
                said, pitch = f'<{kind} radius="{shape.radius!r}" length="{2 * shape.half_length!r}"/>', math.pi / 2
            free = body.motion == "free"
            mass = body.mass if free else heavy_of(scene, body) if is_moved(body) else 0.0
            moments = body.inertia if free else (mass, mass, mass)
            text = URDF.format(name=body.name, mass=mass, i=moments, shape=said, pitch=pitch)
            Path(folder, f"{k}.urdf").write_text(text, encoding="ascii")
            w, x, y, z = turn
            path = str(Path(folder, f"{k}.urdf"))
            bodies.append(p.loadURDF(path, list(place), [x, y, z, w], useFixedBase=int(mass == 0.0), **how))
            offsets.append(np.subtract(place, body.pose[:3]))
            p.changeDynamics(bodies[-1], -1, restitution=restitution[k], lateralFriction=friction[k])
            for line in lines:
                if "changeDynamics" in line:
                    exec(line, {"p": p, "body": bodies[-1]})
            if free:
                p.resetBaseVelocity(bodies[-1], body.twist[:3], body.twist[3:])
    for i, j in combinations(range(len(bodies)), 2):
        if "free" not in (scene.bodies[i].motion, scene.bodies[j].motion):
            p.setCollisionFilterPair(bodies[i], bodies[j], -1, -1, 0)

    def state():
        pose, twist = [], []
        for body, asked, offset in zip(bodies, scene.bodies, offsets, strict=True):
            place, (x, y, z, w) = p.getBasePositionAndOrientation(body)
            turn = asked.pose[3:] if isinstance(asked.shape, HalfSpace) else (w, x, y, z)
            pose.append([*np.subtract(place, offset), *turn])
            twist.append(np.concatenate(p.getBaseVelocity(body)))
        rows = []
        for told in p.getContactPoints():
            on_a, on_b, normal, along, across = (np.array(told[column]) for column in (5, 6, 7, 11, 13))
            pushed = told[9] * normal + told[10] * along + told[12] * across  # on the first body
            # What is farther than its threshold is not solved, and tells the force of its last solution.
            impulse = np.zeros(3) if told[8] > solved else -dt * pushed
            rows.append((bodies.index(told[1]), bodies.index(told[2]), 0.5 * (on_a + on_b), -normal, impulse, told[8]))
        return pose, twist, rows

    found = [state()]
    for k in range(steps):
        for body, asked in zip(bodies, scene.bodies, strict=True):
            if is_moved(asked):
                p.resetBaseVelocity(body, motion(asked, dt, k), asked.twist[3:])
            elif asked.is_loaded:
                place = p.getBasePositionAndOrientation(body)[0]
                p.applyExternalForce(body, -1, asked.force, place, p.WORLD_FRAME)
                p.applyExternalTorque(body, -1, asked.torque, p.WORLD_FRAME)
        p.stepSimulation()
        found.append(state())
    p.disconnect()
    return found


# ---- Chipmunk --------------------------------------------------------------------------------------------------------


def chipmunk(scene, dt, steps, paste):
    """A `pymunk.Space` with a body and a shape each; half-spaces are thick static polygons."""
    import pymunk

    space = pymunk.Space()
    space.gravity = scene.gravity
    exec(paste, {"space": space})
    elasticity, friction = (by_product(scene, name) for name in ("restitution", "friction"))
    bodies, shapes = [], []
    for k, asked in enumerate(scene.bodies):
        free = asked.motion == "free"
        if free:
            body = pymunk.Body(asked.mass, asked.inertia)
        else:
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC if asked.motion == "prescribed" else pymunk.Body.STATIC)
        body.position, body.angle = asked.pose[:2], asked.pose[2]
        if asked.motion != "fixed":
            body.velocity, body.angular_velocity = asked.twist[:2], asked.twist[2]
        shape = asked.shape
        if isinstance(shape, HalfSpace):
            (x, y), s = shape.normal, shape.offset
            ends = ((-1e4, -1e3), (1e4, -1e3), (1e4, 0.0), (-1e4, 0.0))
            made = pymunk.Poly(body, [((s + deep) * x + along * y, (s + deep) * y - along * x) for along, deep in ends])
        elif isinstance(shape, Disc):
            made = pymunk.Circle(body, shape.radius)
        elif isinstance(shape, Box):
            made = pymunk.Poly.create_box(body, [2.0 * half for half in shape.half_extents])
        elif isinstance(shape, Capsule):
            made = pymunk.Segment(body, (-shape.half_length, 0.0), (shape.half_length, 0.0), shape.radius)
        else:
            made = pymunk.Poly(body, shape.vertices)
        made.elasticity, made.friction = elasticity[k], friction[k]
        if any(asked.surface_velocity):
            made.surface_velocity = asked.surface_velocity
        bodies.append(body)
        shapes.append(made)
    for deep in re.findall(r"start (\S+) deep", paste):
        start_deep(bodies, shapes, eval(deep.replace("^", "**"), {}, {"dt": dt, "g": needs(scene).pull}))
    space.add(*bodies, *shapes)

    def state():
        met = {}
        for k, body in enumerate(bodies):
            if scene.bodies[k].motion == "free":

                def collect(arbiter, k=k):
                    found = arbiter.contact_point_set
                    other = shapes.index(arbiter.shapes[1])
                    if (other, k) not in met:
                        where = np.mean([point.point_a for point in found.points], axis=0)
                        deepest = min(point.distance for point in found.points)
                        row = (k, other, where, np.array(found.normal), -np.array(arbiter.total_impulse), deepest)
                        met[k, other] = row

                body.each_arbiter(collect)
        pose, twist = zip(*(([*b.position, b.angle], [*b.velocity, b.angular_velocity]) for b in bodies), strict=True)
        return pose, twist, list(met.values())

    found = [state()]
    for k in range(steps):
        for body, asked in zip(bodies, scene.bodies, strict=True):
            if asked.course is not None:
                body.velocity = velocity_over(asked, dt, k)
            elif asked.is_loaded:
                body.force, body.torque = asked.force, asked.torque[0]
        space.step(dt)
        found.append(state())
    return found


def start_deep(bodies, shapes, deep):
    """Move bodies by the least that lets all that touch overlap by ``deep``: as a user does by hand."""
    import pymunk

    space, skin = pymunk.Space(), 1e-6 * LENGTH
    before = [shape.radius for shape in shapes]
    space.add(*bodies, *shapes)
    for shape in shapes:
        shape.unsafe_set_radius(shape.radius + skin)
    rows, wanted = [], []
    for i, shape in enumerate(shapes):
        for hit in space.shape_query(shape):
            j = shapes.index(hit.shape)
            free = [bodies[k].body_type == pymunk.Body.DYNAMIC for k in (i, j)]
            if i < j and any(free):
                normal = np.array(hit.contact_point_set.normal)
                row = np.zeros((len(bodies), 2))
                row[i], row[j] = -free[0] * normal, free[1] * normal
                rows.append(row.ravel())
                depth = max(abs(point.distance) for point in hit.contact_point_set.points)
                wanted.append(-deep - max(0.0, 2.0 * skin - depth))
    space.remove(*bodies, *shapes)
    for shape, radius in zip(shapes, before, strict=True):
        shape.unsafe_set_radius(radius)
    if rows:
        shift = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0].reshape(-1, 2)
        for body, moved in zip(bodies, shift, strict=True):
            body.position = (body.position.x + moved[0], body.position.y + moved[1])


BARE = {"mujoco": mujoco, "bullet": bullet, "chipmunk": chipmunk}
