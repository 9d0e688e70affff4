"""What two outside solvers are asked, and their protocol (`adapters.pipe`): gaps and their Jacobians, no mechanics.

A world has the velocities of each free body in ``v``, in the order of its pose. Turns in space are exact without
gyroscopic terms, so moments of inertia must be equal there.
"""

import itertools
import json
import math
import os
import sys

import numpy as np

#: A gap of no contact [m].
FAR = 1e3
#: Corners of boxes of one width stand on each other's edges, but for their rounding [m].
EDGE = 1e-6
#: A smaller one is told [m].
NEAR = 1e-3
#: A planted fault: scales friction and restitution of all pairs (`test_oracles.py`).
FAULT = float(sys.argv[1])


def hello(name, version, order, settings):
    return {
        "protocol": 1,
        "name": name,
        "version": version,
        "facts": {
            "title": name,
            "dimensions": [2, 3],
            "scheme": {"order": order, "position_offset": 1},
            "customary_dt": 0.001,
        },
        "profiles": {"plain": settings},
    }


def refuses(scene):
    for body in scene["bodies"]:
        kind, free = body["shape"]["type"], body["motion"] == "free"
        if kind not in ("disc", "sphere", "box", "half_space") or body["motion"] == "prescribed":
            return f"{body['name']}: discs, balls, boxes and fixed half-spaces only"
        if free and scene["dimension"] == 3 and len({round(each, 12) for each in body["inertia"]}) > 1:
            return f"{body['name']}.inertia: gyroscopic terms are not posed"
    return None


class World:
    """Bodies, and the contacts that they may have."""

    def __init__(self, scene, dt, settings):
        self.scene, self.dt, self.settings, self.d = scene, dt, settings, scene["dimension"]
        self.pose = [np.array(body["pose"], float) for body in scene["bodies"]]
        self.twist = [np.array(body["twist"], float) for body in scene["bodies"]]
        self.free = [k for k, body in enumerate(scene["bodies"]) if body["motion"] == "free"]
        self.touch = [row for row in self._candidates() if row[0] in self.free or row[1] in self.free]
        self.told = []

    def mass(self, k):
        """Masses and moments of a body, and its load, in the order of its twist."""
        body = self.scene["bodies"][k]
        inertia = [body["mass"]] * self.d + list(np.atleast_1d(body["inertia"]))
        force = [f + body["mass"] * g for f, g in zip(body["force"], self.scene["gravity"], strict=True)]
        return inertia, force + list(body["torque"])

    def pair(self, i, j):
        """Restitution and friction."""
        pairs = (each for each in self.scene["pairs"] if set(each["bodies"]) == {i, j})
        found = next(pairs, self.scene["material"])
        return FAULT * found["restitution"], FAULT * found["friction"]

    def rows(self):
        """Of each contact the point, the axes (normal first), the gap and the Jacobian by body."""
        for i, j, reading in self.touch:
            point, normal, gap = reading()
            if self.d == 2:
                across = [np.array([-normal[1], normal[0]])]
            else:
                first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
                first = first / np.linalg.norm(first)
                across = [first, np.cross(normal, first)]
            axes = np.array([normal, *across])
            jacobian = {}
            for k, sign in ((i, 1.0), (j, -1.0)):
                turns = [np.atleast_1d(np.cross(point - self._place(k), along)) for along in axes]
                jacobian[k] = sign * np.hstack([axes, turns])
            yield point, axes, gap, jacobian

    def turn(self, k, along):
        """Move a body by a displacement, in the order of its twist."""
        if self.d == 2:
            self.pose[k] = self.pose[k] + along
            return
        angle = np.linalg.norm(along[3:])
        w, v = math.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / math.pi) * along[3:]
        a, u = self.pose[k][3], self.pose[k][4:]
        self.pose[k] = np.array([*(self.pose[k][:3] + along[:3]), w * a - v @ u, *(w * u + a * v + np.cross(v, u))])

    def tell(self, posed, impulses):
        """Keep what is near or acts."""
        self.told = []
        for (i, j, _), (point, axes, gap, _), impulse in zip(self.touch, posed, impulses, strict=True):
            if gap < NEAR or impulse is None or impulse.any():
                row = {"bodies": [j, i], "gap": float(gap), "point": point.tolist(), "normal": axes[0].tolist()}
                self.told.append({**row, "impulse": None if impulse is None else (impulse @ axes).tolist()})

    def read(self):
        told = {name: [each.tolist() for each in getattr(self, name)] for name in ("pose", "twist")}
        return {**told, "contacts": self.told}

    def _candidates(self):
        """Pairs (i, j, reading): the reading gives point, normal from j to i, and gap."""
        bodies = self.scene["bodies"]
        for i, j in itertools.permutations(range(len(bodies)), 2):
            a, b = bodies[i]["shape"], bodies[j]["shape"]
            round_a, round_b = (each["type"] in ("disc", "sphere") for each in (a, b))
            if a["type"] == "half_space":
                continue
            if round_a and b["type"] == "half_space":
                yield i, j, lambda i=i, r=a["radius"], b=b: self._on_plane(self._place(i), r, b)
            elif round_a and round_b and i < j:
                yield i, j, lambda i=i, j=j, a=a, b=b: self._balls(i, j, a["radius"], b["radius"])
            elif round_a and b["type"] == "box":
                yield i, j, lambda i=i, j=j, r=a["radius"], b=b: self._on_box(self._place(i), r, i, j, b)
            elif a["type"] == "box" and b["type"] in ("half_space", "box"):
                for corner in itertools.product(*[(-h, h) for h in a["half_extents"]]):
                    if b["type"] == "half_space":
                        yield i, j, lambda i=i, c=corner, b=b: self._on_plane(self._at(i, c), 0.0, b)
                    else:
                        yield i, j, lambda i=i, c=corner, j=j, b=b: self._on_box(self._at(i, c), 0.0, i, j, b)

    def _place(self, k):
        return self.pose[k][: self.d]

    def _axes(self, k):
        if self.d == 2:
            c, s = math.cos(self.pose[k][2]), math.sin(self.pose[k][2])
            return np.array([[c, -s], [s, c]])
        w, *v = self.pose[k][3:] / np.linalg.norm(self.pose[k][3:])
        cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
        return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross

    def _at(self, k, corner):
        return self._place(k) + self._axes(k) @ np.array(corner)

    def _on_plane(self, place, radius, plane):
        normal = np.array(plane["normal"])
        gap = place @ normal - plane["offset"] - radius
        return place - radius * normal, normal, gap

    def _balls(self, i, j, a, b):
        between = self._place(i) - self._place(j)
        far = np.linalg.norm(between)
        return self._place(j) + b * between / far, between / far, far - a - b

    def _on_box(self, place, radius, i, j, box):
        """A corner or a ball over the face that looks towards its body; past its edges there is no contact."""
        axes, half = self._axes(j), np.array(box["half_extents"])
        towards, local = ((each - self._place(j)) @ axes for each in (self._place(i), place))
        axis = int(np.argmax(np.abs(towards) - half))
        side = math.copysign(1.0, towards[axis])
        over = side * local[axis] - half[axis]
        past = np.delete(np.abs(local) - half, axis).max() > EDGE
        return place - radius * side * axes[:, axis], side * axes[:, axis], FAR if past else over - radius


def serve(greeting, world):
    """Answer questions until there are none; what a library prints goes to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        asked = json.loads(line)
        if asked["ask"] == "hello":
            answer = greeting
        elif asked["ask"] == "refuses":
            answer = {"refuses": refuses(asked["scene"])}
        elif asked["ask"] == "build":
            made = world(asked["scene"], asked["dt"], asked["settings"])
            answer = {**made.read(), "readback": {"dt": asked["dt"]}}
        else:
            for _ in range(asked["steps"]):
                made.step()
            answer = made.read()
        print(json.dumps({"id": asked["id"], **answer}), file=answers, flush=True)
