"""Scene files by the thousand: valid ones with all that the format has a word for, and what is spoilt of them."""

import copy
import math


def number(dice, low, high):
    return round(dice.uniform(low, high), dice.choice((1, 3, 15)))


def vector(dice, size, low, high):
    return [number(dice, low, high) for _ in range(size)]


def attitude(dice, dimension):
    if dimension == 2:
        return [number(dice, -3.0, 3.0)]
    q = [dice.gauss(0.0, 1.0) for _ in range(4)]
    return [1.0, 0.0, 0.0, 0.0] if dice.random() < 0.4 else [x / math.hypot(*q) for x in q]


def shape(dice, dimension):
    """A shape within 1 m of its centre."""

    def size():
        return round(dice.uniform(0.05, 0.4), 3)

    kind = dice.choice(("round", "box", "capsule", "corners") if dimension == 2 else
                       ("round", "box", "capsule", "cylinder", "corners"))  # fmt: skip
    if kind == "round":
        return {"type": "disc" if dimension == 2 else "sphere", "radius": size()}
    if kind == "box":
        return {"type": "box", "half_extents": [size() for _ in range(dimension)]}
    if kind in ("capsule", "cylinder"):
        return {"type": kind, "half_length": size(), "radius": size()}
    if dimension == 2:
        count, radius = dice.randrange(3, 9), size()
        angles = [2.0 * math.pi * (k + 0.3 * dice.random()) / count for k in range(count)]
        away = vector(dice, 2, -0.3, 0.3)
        return {"type": "polygon", "vertices": [[radius * math.cos(a) + away[0], radius * math.sin(a) + away[1]]
                                                for a in angles]}  # fmt: skip
    # Corners of a box cut or not: symmetric about three planes, so that the main axes are the body's.
    a, b, c = size(), size(), size()
    return {"type": "hull", "vertices": [[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)]
            + ([[0.0, 0.0, 1.5 * c], [0.0, 0.0, -1.5 * c]] if dice.random() < 0.5 else [])}  # fmt: skip


def floor(dice, d):
    body = {"name": "floor", "shape": {"type": "half_space", "angle": number(dice, -0.3, 0.3)}, "motion": "fixed"}
    if dice.random() < 0.3:
        body["shape"] = {"type": "half_space", "normal": [0.0] * (d - 1) + [2.0], "offset": number(dice, -0.5, 0.0)}
        if dice.random() < 0.5:
            body["surface_velocity"] = [*vector(dice, d - 1, -2.0, 2.0), 0.0]
        else:
            body |= {"motion": "prescribed", "twist": [*vector(dice, d, -0.5, 0.5), *[0.0] * (1 if d == 2 else 3)]}
            if dice.random() < 0.5:
                body["course"] = {"amplitude": vector(dice, d, -0.05, 0.05), "frequency": number(dice, 0.5, 5.0)}
    return body


def body(dice, d, k):
    """The k-th body, in a cell of its own, 2.5 m wide."""
    place = [2.5 * k, *([number(dice, -0.3, 0.3)] if d == 3 else []), number(dice, 0.9, 2.0)]
    made = {"name": dice.choice((f"b{k}", f"körper {k}", f"a/b {k}")), "shape": shape(dice, d),
            "pose": [*place, *attitude(dice, d)]}  # fmt: skip
    if dice.random() < 0.15:
        return made | {"motion": "prescribed", "twist": vector(dice, 3 if d == 2 else 6, -1.0, 1.0)}
    if dice.random() < 0.1:
        return made | {"motion": "fixed"}
    made["twist"] = vector(dice, 3 if d == 2 else 6, -3.0, 3.0)
    made[dice.choice(("mass", "density"))] = round(10.0 ** dice.uniform(-1.0, 2.0), 3)
    if dice.random() < 0.3:
        made["force"], made["torque"] = vector(dice, d, -5.0, 5.0), vector(dice, 1 if d == 2 else 3, -0.2, 0.2)
    return made


def valid(dice, steps, dt):
    """One scene file as plain data: it parses, and engines run it for so many steps."""
    d = dice.choice((2, 3))
    bodies = [floor(dice, d)] if dice.random() < 0.85 else []
    bodies += [body(dice, d, k) for k in range(dice.randrange(1, 5))]
    free = next((b["name"] for b in bodies if b.get("motion", "free") == "free"), None)
    if free is None:
        bodies.append(body(dice, d, 9) | {"motion": "free"})
        free = bodies[-1]["name"]
    data = {"name": f"generated {dice.randrange(10**6)}", "dimension": d, "format": 1,
            "gravity": [0.0] * (d - 1) + [-number(dice, 0.0, 20.0)], "duration": steps * dt,
            "bodies": bodies}  # fmt: skip
    common = {"restitution": number(dice, 0.0, 1.0), "friction": number(dice, 0.0, 1.5)}
    data["pairs"] = [common]
    if dice.random() < 0.2 and bodies[0]["name"] == "floor":
        data["pairs"].append({"a": "floor", "b": free, "restitution": 0.0, "friction": 0.5})
    if dice.random() < 0.5:
        data["constants"] = {"h": 1.5, "late": "0.5 * h"}
        data["checks"] = [{"quantity": f"{free}.{'y' if d == 2 else 'z'}", "value": "h - 0.5 * g * t ** 2",
                           "tolerance": "h + late + g * dt"}]  # fmt: skip
    if d == 2 and dice.random() < 0.3:
        data["growth"] = dice.choice((5e4, "exp(2 * t)"))
    return data


#: Values that are put where others were expected.
STRANGE = [
    None, True, False, 0, -1, 1, 2, 7, 1e308, -1e308, 1e-320, -0.0, math.nan, math.inf, -math.inf, 10**400, 10**4000,
    "", "*", "x" * 200, "<script>alert(1)</script>", "=1+1", "[red]", "[/]", "a|b", "\x1b[2J", "\x00", "\ud800",
    "\u202e", "ball", [], {}, [[]], [0.0], [0.0] * 3, [0.0] * 7, ["x"], {"type": "disc"}, {"a": {"b": 1}},
    [math.nan, 0.0],
]  # fmt: skip


def places(value, path=()):
    """Every place in nested data."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def mutated(data, dice):
    """The same data with one to three things wrong, or merely different."""
    data = copy.deepcopy(data)
    for _ in range(dice.choice((1, 1, 1, 2, 3))):
        path = dice.choice(list(places(data))[1:])
        owner = data
        for key in path[:-1]:
            owner = owner[key]
        what, key = dice.random(), path[-1]
        if what < 0.45:
            owner[key] = copy.deepcopy(dice.choice(STRANGE))  # a list of ours would grow from file to file
        elif what < 0.6:
            del owner[key]
        elif what < 0.7 and isinstance(owner, list):
            owner.append(copy.deepcopy(owner[key]))
        elif what < 0.8 and isinstance(owner, dict):
            owner[dice.choice(["mass", "extra", "friction", "\x1b", "type", ""])] = owner[key]
        elif isinstance(owner[key], float):
            owner[key] *= 10.0 ** dice.uniform(-3.0, 3.0) * dice.choice((1.0, 1.0, -1.0))
    return data
