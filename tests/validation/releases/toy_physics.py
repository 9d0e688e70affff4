"""One disc above a floor: velocity first, then position."""

__version__ = "VERSION"
KEEPS = 1.0
FASTEST = float("inf")


class Disc:
    def __init__(self, pose, twist, mass, inertia, radius, floor, bounce, gravity, load):
        self.pose, self.twist, self.mass, self.radius = list(pose), list(twist), mass, radius
        self.floor, self.bounce, self.impulse = floor, bounce, 0.0
        self.gain = [g + f / mass for g, f in zip(gravity, load, strict=False)] + [load[2] / inertia]

    def step(self, dt):
        approach = self.twist[1]
        self.twist = [v + a * dt for v, a in zip(self.twist, self.gain, strict=True)]
        self.impulse = 0.0
        if self.floor is not None and self.pose[1] - self.radius - self.floor <= 1e-12:
            least = min(-min(approach, 0.0) * self.bounce * KEEPS, FASTEST)
            if self.twist[1] < least:
                self.impulse = self.mass * (least - self.twist[1])
                self.twist[1] = least
        self.pose = [x + v * dt for x, v in zip(self.pose, self.twist, strict=True)]
