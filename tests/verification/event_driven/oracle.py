"""The event-driven oracle: closed-form flight from event to event."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from reference_solver.model import Array, Model
from reference_solver.records import Contacts, Record
from tests.verification.event_driven.bodies import PLANE, Bodies
from tests.verification.event_driven.contacts import Contact, Geometry, Rows
from tests.verification.event_driven.errors import OracleError, TooManyEvents
from tests.verification.event_driven.flight import Flight
from tests.verification.event_driven.impact import Impacts, Struck
from tests.verification.event_driven.prediction import next_meeting, touch_length
from tests.verification.event_driven.rest import Rest

Law = Literal["N-SIM", "N-SEQ"]

#: Events closer than this share of the time are simultaneous, and the law decides their order: the rounding of a root.
TIE = 16.0 * 2.220446049250313e-16
#: An event whose gap is not zero to this many rounding lengths was predicted wrongly.
ASTRAY = 1e6


@dataclass(frozen=True)
class Event:
    """Something that happened at time ``t`` [s] between bodies ``a`` < ``b``.

    Parameters
    ----------
    kind
        ``impact``; ``rest``: an impact that ends an accumulation, with t its end; ``stick``: sliding ended.
    impulse
        (d,) on body b [N s].
    approach
        Normal velocity before [m/s], at most 0.
    work
        Energy that the contact gave to the bodies [J]; above round-off the law created it (Kane's paradox).
    solutions
        How many solutions the law had.
    """

    t: float
    a: int
    b: int
    kind: Literal["impact", "rest", "stick"]
    impulse: Array
    approach: float
    work: float
    solutions: int


class EventDriven:
    """A model advanced from event to event.

    Parameters
    ----------
    model
        Discs or spheres (equal moments), half-spaces, prescribed bodies with constant velocity, at most one planar
        box. Bodies may touch at the start but not overlap.
    law
        ``N-SEQ``: one pair at a time, simultaneous ones in order of (body_a, body_b). ``N-SIM``: all contacts that
        touch at that instant, directly or through others, together.
    most_events
        Bound on events, after which a run is given up.

    Raises
    ------
    ValueError
        For a model without closed form, bodies in overlap, an unknown law.
    """

    def __init__(self, model: Model, law: Law = "N-SEQ", most_events: int = 10_000_000) -> None:
        if law not in ("N-SIM", "N-SEQ"):
            raise ValueError(f"law: {law!r} is neither 'N-SIM' nor 'N-SEQ'")
        self.model, self.law, self.most_events = model, law, most_events
        self.bodies = Bodies(model)
        self.flight = Flight(model, self.bodies)
        self.time = 0.0
        self.steps = 0
        self.events: list[Event] = []
        self._geometry = Geometry(self.bodies, self.flight)
        self._impacts = Impacts(self.bodies, self.flight)
        self._rest = Rest(self.bodies, self.flight, self._geometry)
        self._next = np.full(self.bodies.count, math.inf)
        self._partner = np.full(self.bodies.count, -1)
        self._late = np.zeros(self.bodies.count)
        self._work, self._best = np.zeros((5, 7)), np.zeros(2)
        self._require_apart()
        for i in np.flatnonzero(self.bodies.free):
            self._rest.settle([int(i)], 0.0)
        for i in np.flatnonzero(self.bodies.free):
            self._predict(int(i))

    def advance(self, until: float) -> None:
        """Let everything happen up to and including time ``until`` [s].

        Raises
        ------
        ValueError
            If ``until`` lies in the past.
        OracleError
            `LeavesClosedForm`, `ContactParadox`, `TooManyEvents`, or an event that was predicted wrongly.
        """
        if not until >= self.time:
            raise ValueError(f"until: {until!r} lies before {self.time!r}")
        while True:
            t = float(self._next.min())
            sticking = min(self._rest.sticking.items(), key=lambda item: item[1], default=(None, math.inf))
            first = min(t, sticking[1])
            if first > until or first == math.inf:
                break
            if self.steps >= self.most_events:
                raise TooManyEvents(self.time, f"{self.most_events} events")
            self.steps += 1
            if sticking[0] is not None and sticking[1] <= t:
                self._stick(sticking[0], max(sticking[1], self.time))
            else:
                self._meet(t)
        self.time = until if math.isfinite(until) else self.time

    def next_event(self) -> float:
        """Time of the next event [s]; inf if there is none."""
        return max(min(float(self._next.min()), *self._rest.sticking.values(), math.inf), self.time)

    def run(self) -> None:
        """Let everything happen, until nothing more will."""
        self.advance(math.inf)

    def record(self, times: Sequence[float] | Array) -> Record:
        """Return the states at ``times`` [s] (ascending), each after the events of its instant; no contacts."""
        pose, twist = [], []
        for t in times:
            self.advance(float(t))
            pose.append(self.flight.pose(float(t)))
            twist.append(self.flight.twist(float(t)))
        none = np.zeros(len(pose) + 1, np.int64)
        contacts = Contacts.empty(0, self.model.dimension)
        return Record(np.array(times, dtype=np.float64), np.array(pose), np.array(twist), none, contacts)

    @property
    def pose(self) -> Array:
        """Poses (n, 3 | 7) now."""
        return self.flight.pose(self.time)

    @property
    def twist(self) -> Array:
        """Twists (n, 3 | 6) now."""
        return self.flight.twist(self.time)

    def energy(self) -> float:
        """Kinetic energy and potential of the constant loads, of all free bodies now [J]."""
        return math.fsum(self.flight.energy(self.time))

    @property
    def certificate(self) -> dict[str, Any]:
        """What can be said against the run.

        ``events``: how many; ``created``: largest energy that one impact created [J]; ``kane``: whether that is more
        than round-off of the impact's own energy; ``unique``: every problem had exactly one solution.
        """
        created = max((e.work for e in self.events), default=0.0)
        kane = any(e.work > 1e-12 * abs(e.approach) * float(np.abs(e.impulse).max()) for e in self.events)
        unique = all(e.solutions == 1 for e in self.events) and self._rest.solutions == (1, 1)
        return {"events": len(self.events), "created": max(created, 0.0), "kane": kane, "unique": unique}

    def _require_apart(self) -> None:
        for a in map(int, np.flatnonzero(self.bodies.free)):
            for b in self._geometry.overlapping(a, 0.0):
                gap = min(c.gap for c in self._geometry.between(a, b, 0.0, always=True))
                raise ValueError(f"bodies: {min(a, b)} and {max(a, b)} overlap by {-gap:.3g} m")

    def _touch(self, a: int, b: int) -> float:
        f = self.flight
        return float(touch_length(a, b, self.time, f.x0, f.v0, self.bodies.reach, self.bodies.offset))

    def _predict(self, i: int) -> None:
        """Find body i's next contact."""
        if i == self.bodies.box:
            resting = {j for key in self._rest.sticking if i in key[:2] for j in key[:2]}
            assert self._geometry.box is not None
            self._next[i], self._partner[i] = self._geometry.box.next_meeting(resting)
            return
        flown = self._geometry.flown()
        self._partner[i] = next_meeting(i, self.bodies.skipped, flown, self._work, self._best)
        self._next[i], self._late[i] = self._best

    def _predict_around(self, changed: set[int]) -> None:
        """Find the next contacts of changed bodies and of those that were going to meet one of them."""
        waiting = set(changed)
        for i in changed:
            waiting.update(np.flatnonzero(self._partner == i).tolist())
        if self.bodies.box >= 0:
            waiting.add(self.bodies.box)
        for i in sorted(waiting):
            if self.bodies.free[i]:
                self._predict(i)

    def _meet(self, earliest: float) -> None:
        """Carry out the first event; where several tie, the one of the lowest pair."""
        tied = np.flatnonzero(self._next <= earliest * (1.0 + TIE))
        pairs = [(min(int(i), int(self._partner[i])), max(int(i), int(self._partner[i])), int(i)) for i in tied]
        a, b, i = min(pairs)
        t, late = float(self._next[i]), float(self._late[i])
        if t < self.time:
            t, late = self.time, 0.0
        self.time = t
        approach = self._approach(a, b)
        for k in (a, b):
            self.flight.anchor(k, t, late)
        pair = self._geometry.between(a, b, t, always=True)
        self._close(pair, t, approach)
        contacts = [self._fastest(pair)] if self.law == "N-SEQ" else self._touching(pair, t, late)
        struck = self._impacts.resolve(contacts, t)
        self.events += [self._event(s, t) for s in struck if s.approach < 0.0 or s.impulse.any()]
        changed = {k for c in contacts for k in (c.a, c.b) if self.bodies.free[k]}
        self._predict_around(self._rest.settle(sorted(changed), t) | changed)

    def _approach(self, a: int, b: int) -> float | None:
        """Normal speed at which a ball will hit a plane, from its anchor [m/s]: exact where v + a t would round."""
        kind = self.bodies.kind
        ball, plane = (a, b) if kind[b] == PLANE else (b, a)
        if kind[plane] != PLANE or ball == self.bodies.box:
            return None
        base = max(self.flight.t0[ball], self.flight.t0[plane])
        contact = self._geometry.between(a, b, base, always=True)[0]
        gap = contact.gap if contact.gap > self._touch(a, b) else 0.0
        n = self.bodies.normal[plane]
        rate = float(n @ (self.flight.velocity(ball, base) - self.flight.v0[plane]))
        return math.sqrt(max(rate * rate - 2.0 * float(n @ self.flight.a0[ball]) * gap, 0.0))

    def _close(self, pair: list[Contact], t: float, approach: float | None) -> None:
        """Put the pair into contact exactly: the gap left is round-off of the root, and is not carried on."""
        f, bodies = self.flight, self.bodies
        contact = min(pair, key=lambda c: c.gap)
        a, b = contact.a, contact.b
        if abs(contact.gap) > ASTRAY * self._touch(a, b):
            raise OracleError(t, f"bodies {a} and {b} meet with a gap of {contact.gap:.3g} m")
        share = contact.gap / (bodies.inverse_mass[a] + bodies.inverse_mass[b])
        f.x0[a] += share * bodies.inverse_mass[a] * contact.normal
        f.x0[b] -= share * bodies.inverse_mass[b] * contact.normal
        if approach is not None:
            ball, plane = (a, b) if bodies.kind[b] == PLANE else (b, a)
            n = bodies.normal[plane]
            f.v0[ball] -= (approach + float(n @ (f.v0[ball] - f.v0[plane]))) * n

    def _touching(self, pair: list[Contact], t: float, late: float) -> list[Contact]:
        """All contacts that are connected with a pair of bodies at this instant, which are anchored to it."""
        found = {c.key: c for c in pair}
        waiting = [pair[0].a, pair[0].b]
        seen = set(waiting)
        while waiting:
            i = waiting.pop()
            if not self.bodies.free[i]:
                continue
            self.flight.anchor(i, t, late)
            for c in self._geometry.around(i, t):
                found.setdefault(c.key, c)
                waiting += [k for k in (c.a, c.b) if k not in seen]
                seen.update((c.a, c.b))
        return [found[key] for key in sorted(found)]

    def _fastest(self, pair: list[Contact]) -> Contact:
        """Return the contact of a pair that closes fastest, the first where several do."""
        if len(pair) == 1:
            return pair[0]
        closing = Rows(self.bodies, pair, tangential=False).relative(self.flight.v0, self.flight.w0)
        return pair[int(np.argmin(closing))]

    def _event(self, s: Struck, t: float) -> Event:
        c = s.contact
        kind: Literal["impact", "rest"] = "rest" if s.came_to_rest else "impact"
        end = t + self._remaining(s) if s.came_to_rest else t
        return Event(end, c.a, c.b, kind, s.impulse, s.approach, s.work, s.solutions)

    def _remaining(self, s: Struck) -> float:
        """Time that the rest of an accumulation takes, 2 e |u| / (g (1 - e)) [s] (O13); 0 without a pressing load."""
        c = s.contact
        e = float(self.bodies.restitution[c.a, c.b])
        pull = -float(c.normal @ (self.bodies.load[c.b] - self.bodies.load[c.a]))
        return 2.0 * e * -s.approach / (pull * (1.0 - e)) if pull > 0.0 and e < 1.0 else 0.0

    def _stick(self, key: tuple[int, int, int], t: float) -> None:
        self.time = t
        changed = self._rest.stick(key, t)
        self.events.append(Event(t, key[0], key[1], "stick", np.zeros(self.model.dimension), 0.0, 0.0, 1))
        self._predict_around(changed)
