"""Rods with friction: Painleve's around its threshold, Kane's that gains energy, two that lean on each other."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.exact_contact import coulomb_solutions
from reference_solver.model import Array, Body, Capsule, Model
from reference_solver.settings import Settings
from reference_solver.verification.hard_cases.case import HardCase, Run, Verdict, diverged, energy, within
from reference_solver.verification.hard_cases.parts import DOWN, DT, FLOOR, GRAVITY, rod
from reference_solver.verification.hard_cases.stacks import stands_or_falls

#: Half length, end radius [m] and lean over the horizontal [rad] of the sliding rod, its lower end to the right.
HALF, END, LEAN = 1.0, 0.01, math.radians(60.0)


def tip_matrix(lean: float = LEAN) -> Array:
    """W (2, 2) at the lower end of the rod, rows normal and tangent; the tangent points to the left (E54) [1/kg]."""
    an, at = HALF * math.cos(lean), -(HALF * math.sin(lean) + END)
    inertia = HALF**2 / 3.0
    return np.array([[1.0 + an * an / inertia, an * at / inertia], [an * at / inertia, 1.0 + at * at / inertia]])


def threshold(lean: float = LEAN) -> float:
    """Friction beyond which pressing the sliding end pulls it down: W_nn + mu W_nt = 0 (E54)."""
    w = tip_matrix(lean)
    return float(-w[0, 0] / w[0, 1])


def sliding_rod(speed: float, spin: float) -> Body:
    """Return the rod, its lower end on the floor and sliding to the right with ``speed`` [m/s]."""
    an, at = HALF * math.cos(LEAN), -(HALF * math.sin(LEAN) + END)
    vx = speed + spin * at  # the end's own velocity is (vx - w r_y, vy + w r_x)
    height = HALF * math.sin(LEAN) + END
    return rod(0.0, height, -LEAN, HALF, END, twist=(vx, -spin * an, spin))


def painleve(share: float, spin: float, dt: float = 1e-6, speed: float = 1.0) -> HardCase:
    """Rod sliding with friction of ``share`` times the threshold; ``spin`` [rad/s] lifts its end or lets it press."""
    mu = share * threshold()

    def model() -> Model:
        return Model(2, [FLOOR, sliding_rod(speed, spin)], DOWN, 0.0, mu)

    def judge(run: Run) -> Verdict:
        w = tip_matrix()
        # Normal acceleration of the end without contact: gravity, and its turning about the centre. A step knows levers
        # at its start only: what turning adds it sees one step later.
        lift = -GRAVITY + spin * spin * (HALF * math.sin(LEAN) + END)
        forces = coulomb_solutions(w, np.array([lift, 0.0]), [mu], sliding=[-1.0])
        steps = coulomb_solutions(w, np.array([-GRAVITY * run.settings.dt, -speed]), [mu])
        impulse = run.impulse(-1, 0, 1)
        found = np.array([impulse[1], -impulse[0]])
        # A step that is solved at its start finds a solution of its impulses, one that goes by forces one of those.
        answers = [(solution, solution.impulse[0]) for solution in steps]
        answers += [(solution, run.settings.dt * solution.impulse[0]) for solution in forces]
        misses = [float(np.abs(found - wanted).max()) for _, wanted in answers]
        # g dt: what the ends of the step may differ by between schemes that solve at its start or locate events
        if not misses or min(misses) > 4.0 * GRAVITY * run.settings.dt:
            return diverged(f"impulse {found} is none of the {len(steps)} solutions of the step, nor of its forces")
        return Verdict(
            True,
            {"solutions of forces": len(forces), "solutions of the step": len(steps), "impulse [N s]": float(found[0])},
            f"one of the step's solutions: {answers[int(np.argmin(misses))][0].modes[0]}",
        )

    side = "below" if share < 1.0 else "above"
    return HardCase(
        f"Painleve rod, {side} its threshold, {'lifting' if spin else 'pressing'}",
        "Rigid bodies with friction may have no forces or two; the step's impulses exist all the same",
        model,
        Settings.reference(dt),
        dt,
        judge,
        {"solutions of forces": 1.0 if share < 1.0 else 2.0 if spin else 0.0, "solutions of the step": 1.0},
    )


#: Lean [rad], friction and restitution for which Newton's law gives the rod energy (E54).
KANE_LEAN, KANE_FRICTION, KANE_RESTITUTION = math.radians(56.4), 0.883, 0.9988


def kane(slide: float) -> HardCase:
    """Rod falling at 1 m/s on its right end while that end slides with ``slide`` [m/s], without gravity."""

    def model() -> Model:
        height = HALF * math.sin(KANE_LEAN) + END
        hitting = rod(0.0, height, -KANE_LEAN, HALF, END, twist=(slide, -1.0, 0.0))
        return Model(2, [FLOOR, hitting], (0.0, 0.0), KANE_RESTITUTION, KANE_FRICTION)

    def judge(run: Run) -> Verdict:
        w, before = tip_matrix(KANE_LEAN), np.array([-1.0, -slide])
        found = coulomb_solutions(w, before + np.array([KANE_RESTITUTION * before[0], 0.0]), [KANE_FRICTION])
        p = found[0].impulse[0]
        law = float(p @ (before + 0.5 * w @ p))
        total = energy(run.model, run.record.pose, run.record.twist)
        gain = float(total[-1] - total[0])
        if len(found) != 1:
            return diverged(f"the impact has {len(found)} solutions")
        flag = float(gain > 0.0)
        reason = "Newton's law with friction creates this energy: flagged" if flag else "no energy is created"
        answer = {"energy gained [J]": gain, "error of the law's gain [J]": gain - law, "Kane flag": flag}
        return within({"error of the law's gain [J]": 1e-12}, answer, reason)

    return HardCase(
        f"Kane's paradox, slides {'with' if slide > 0.0 else 'against'} its lean",
        "Newton's restitution and friction together can create energy: a property of the law, flagged",
        model,
        Settings.reference(DT),
        DT,
        judge,
        {"Kane flag": float(slide < 0.0)},
        excused=("gain",),
    )


#: Half angle of the tent at its top [rad], half length and end radius of its cards [m].
TENT, CARD, ROUND = math.radians(20.0), 1.0, 1e-3


def tent_limit() -> float:
    """Friction at which two cards that lean on each other just stand, smooth at the top (E55).

    Moments about a foot: H (2 l cos phi + r) = m g l sin phi; a foot holds H while H <= mu m g. For thin cards
    tan(phi) / 2.
    """
    return CARD * math.sin(TENT) / (2.0 * CARD * math.cos(TENT) + ROUND)


def card_tent(share: float) -> HardCase:
    """Two cards with friction of ``share`` times the limit at their feet."""

    def model() -> Model:
        x, y = CARD * math.sin(TENT) + ROUND, CARD * math.cos(TENT) + ROUND
        left = rod(-x, y, 0.5 * math.pi - TENT, CARD, ROUND)
        right = rod(x, y, 0.5 * math.pi + TENT, CARD, ROUND)
        friction = np.full((3, 3), share * tent_limit())
        friction[1, 2] = friction[2, 1] = 0.0
        return Model(2, [FLOOR, left, right], DOWN, 0.0, friction)

    def moved(run: Run) -> float:
        return float(np.abs(run.record.pose[-1, 1:] - run.record.pose[0, 1:]).max())

    return HardCase(
        f"card tent, mu {100.0 * (share - 1.0):+.0f} %",
        "Stands by friction alone: one hundredth of it decides, and creep would bring it down",
        model,
        Settings.reference(DT),
        0.5,
        stands_or_falls(moved, 1e-9, 1e-3, "largest motion [m, rad]"),
        {"falls": float(share < 1.0)},
        stride=12,
    )


#: Radius of the fixed capsule, radius and half length of the one across it [m].
LOG, ROD, REACH = 0.5, 0.1, 1.0
#: Spin at the start [rad/s].
ROCK = 1.0
#: Error of the fifth-order scheme over the run, and a hundredfold of it for other machines: metres, share of energy.
CROSSED = 1e-9


def crossed_capsules(dt: float = DT) -> HardCase:
    """A capsule rocks across a fixed one without slip: its line of contact rolls, and the normal turns with both.

    Turned by q it touches where the fixed one looks at q, and its own middle is LOG q from there: where it is follows
    from its angle alone, and its energy stays what it was.
    """
    inertia = (REACH**2 + ROD**2) / 3.0

    def model() -> Model:
        upright = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
        log = Body(Capsule(REACH, LOG), motion="fixed", pose=(0.0, 0.0, 0.0, *upright))
        start = (0.0, 0.0, LOG + ROD, 1.0, 0.0, 0.0, 0.0)
        # turned from x towards z is turned about -y; the point that touches is at rest
        twist = (-ROD * ROCK, 0.0, 0.0, 0.0, -ROCK, 0.0)
        rod = Body(Capsule(REACH, ROD), 1.0, (0.5 * ROD**2, inertia, inertia), start, twist)
        return Model(3, [log, rod], (0.0, 0.0, -GRAVITY), 0.0, 5.0)

    def judge(run: Run) -> Verdict:
        pose, twist = run.record.pose[:, 1], run.record.twist[:, 1]
        angle = -2.0 * np.arctan2(pose[:, 5], pose[:, 3])
        along, above = LOG * angle, LOG + ROD
        x = along * np.cos(angle) - above * np.sin(angle)
        z = along * np.sin(angle) + above * np.cos(angle)
        off = np.hypot(pose[:, 0] - x, pose[:, 2] - z)
        energy = 0.5 * (twist[:, :3] ** 2).sum(axis=1) + 0.5 * inertia * twist[:, 4] ** 2
        energy += GRAVITY * (pose[:, 2] - above)
        given = 0.5 * (ROD**2 + inertia) * ROCK**2
        answer = {
            "off its path [m]": float(off.max()),
            "energy, share of the start's": float(np.abs(energy / given - 1.0).max()),
            "swings": float(np.count_nonzero(np.diff(np.sign(angle[1:])))),
        }
        return within(dict.fromkeys(list(answer)[:2], CROSSED), answer, "where it is follows from its angle; energy")

    return HardCase(
        "capsule rocking across a capsule",
        "Lines that cross touch in a point that moves on both: rows frozen over a step gain energy without end",
        model,
        Settings.reference(dt),
        2.0,
        judge,
        excused=("gain",),  # the judge measures energy itself, with the moments of space
    )
