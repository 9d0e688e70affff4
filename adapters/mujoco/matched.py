"""Exact Newton restitution and Coulomb friction with MuJoCo's solver: the loop of profile ``matched``.

MuJoCo's contacts are one convex problem: their forces lie in the cones of friction, the accelerations ``J a - aref`` in
the dual cones, and each contact yields by its regulariser R. Newton's and Coulomb's laws differ from that; a shift of
the references ``aref`` between MuJoCo's calls satisfies them:

    normal      target velocity -e v one step later; for resting bodies a part of the overlap over the step
    slip        ``aref_n`` is lowered by mu |slip|/dt, which cancels the lift by the dual cone (De Saxce)
    softness    ``aref`` is raised by R f, which cancels the yielding of a contact under its force

The last two depend on the solution: a round solves, computes slips and forces, and solves again. For one contact the
first error falls by ``mu^2 G/(1 + mu^2 G)`` a round, G being its mobility along the face over that across it (1 of a
box that only slides, 7/2 of a ball), the second by ``R/(G + R)``, 1 - d; a secant along the last change (Anderson's
mixing of depth one) reduces dozens of rounds to five. Rounds end when all shifts agree with their results to `AGREED`,
or when the difference does not fall: four corners of a face cannot all satisfy rounded distances.

Sources: De Saxce and Feng, "The bipotential method" (1998), the shift; Hestenes and Powell (1969), the method of
multipliers, the softness; Anderson (1965), the secant; MuJoCo documentation, computation: constraint model.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.scene import Scene
from adapters.script import literal

#: Final agreement of shifts, as a share of the largest contact acceleration: some thousand roundings, by contacts 1e4
#: times stiffer than their bodies.
AGREED = 1e-13
#: Allowed final difference, as such a share; a run above it is INVALID. Mesh corners are in single precision: four of a
#: face differ by 6e-8 m, and a tenth of that over the square of a step is 3.5e-5 g at 1/240 s, 5.6e-4 g at 1/960 s. The
#: effect on values is judged by their checks.
SETTLED = 1e-3


def matched_step2(mujoco, model, data, restitution, law):
    """Make the second half of a step, after ``mj_step1``, with Newton's and Coulomb's laws.

    Parameters
    ----------
    restitution
        By indices of two geoms, the smaller first; 0 where it is missing.
    law
        Share of an overlap that a step corrects, and the largest speed of that [m/s]; most rounds; the share of the
        largest acceleration at which they end.

    Returns
    -------
    made, apart
        Number of rounds, and the final difference between shifts and their results, as such a share; 0 where that is
        round-off of velocities over a step.
    """
    share, fastest, rounds, agreed = law
    contacts, dt = data.contact, model.opt.timestep
    touching = np.array(contacts.efc_address) >= 0
    normal = contacts.efc_address[touching]
    if not len(normal):
        mujoco.mj_step2(model, data)
        return 0, 0.0
    # A contact without friction has one row: it is used for both tangents as well, with mu = 0.
    rough = contacts.dim[touching] > 1
    mu = np.where(rough, contacts.friction[touching, 0], 0.0)
    first, second = normal + rough, normal + 2 * rough
    pairs = np.sort(contacts.geom[touching], axis=1).tolist() if restitution else []
    e = np.array([restitution.get((a, b), 0.0) for a, b in pairs]) if restitution else 0.0
    # Compiled references have the target velocity 0 one step later: -v/dt.
    asked = data.efc_aref.copy()
    approach = asked[normal] * dt
    out = np.minimum(-share * contacts.dist[touching] / dt, fastest)
    asked[normal] += np.where((approach > 0.0) & (e > 0.0), np.maximum(e * approach, out), out) / dt
    mujoco.mj_fwdActuation(model, data)
    mujoco.mj_fwdAcceleration(model, data)
    missed, shift, last = np.empty(data.nefc), np.zeros(data.nefc), None
    mujoco.mj_mulJacVec(model, data, missed, data.qacc_smooth)
    largest = np.abs(missed - asked).max() or 1.0
    made = 0
    while made < rounds:
        made += 1
        data.efc_aref[:] = asked + shift
        mujoco.mj_fwdConstraint(model, data)
        mujoco.mj_mulJacVec(model, data, missed, data.qacc)
        missed -= asked
        given = data.efc_R * data.efc_force
        given[normal] -= mu * np.hypot(missed[first], missed[second])
        change = given - shift
        apart = float(np.abs(change).max() / largest)
        if not apart > agreed:
            break
        shift = given
        if last is not None:
            bend = change - last[1]
            if np.abs(bend).max() <= agreed * largest:
                break
            along = change @ bend / max(bend @ bend, 1e-300)
            if abs(along) < 100.0:
                shift = given - along * (given - last[0])
        last = given, change
    # A relative velocity is a sum of twelve products, rounded twice each, which limits the accuracy over a step.
    if apart * largest <= 24.0 * 2.0**-52 * np.abs(data.qvel).max() / dt:
        apart = 0.0
    mujoco.mj_checkAcc(model, data)
    mujoco.mj_Euler(model, data)
    return made, apart


def by_geoms(model, rebounding):
    """Restitution by the indices of two geoms, the smaller first, from rows of two bodies' indices and restitution."""
    geom = {body: int(model.geom(f"geom{body}").id) for row in rebounding for body in row[:2]}
    return {tuple(sorted((geom[a], geom[b]))): e for a, b, e in rebounding}


def rebounding(scene: Scene) -> list[tuple[int, int, float]]:
    """Pairs of bodies with restitution, and its value."""
    return [(a, b, material.restitution) for a, b, material in scene.contact_pairs() if material.restitution > 0.0]


def law_of(settings: Mapping[str, Any]) -> tuple[float, float, int, float]:
    """Arguments ``law`` of `matched_step2`."""
    push, fastest, agreed = (float(settings[name]) for name in ("push_out", "push_out_speed", "agreed"))
    return push, fastest, int(settings["rounds"]), agreed


#: Line of a script that makes the second half of a step.
SECOND_HALF = "matched_step2(mujoco, model, data, RESTITUTION, LAW)"


def loop_lines(scene: Scene, settings: Mapping[str, Any]) -> list[str]:
    """Lines of a script before its loop: the functions above and their arguments."""
    functions = ["", "", *inspect.getsource(by_geoms).splitlines(), "", ""]
    functions += [*inspect.getsource(matched_step2).splitlines(), "", ""]
    return [
        *functions,
        f"RESTITUTION = by_geoms(model, {rebounding(scene)})",
        "# Part of an overlap taken away in a step, most speed of that, most rounds, and where they end.",
        f"LAW = {literal(law_of(settings))}",
    ]


class Matched:
    """Makes the second halves of one model's steps and stores how they ended."""

    def __init__(self, mujoco: Any, scene: Scene, settings: Mapping[str, Any], model: Any, data: Any) -> None:
        self._mujoco, self._model, self._data = mujoco, model, data
        self._restitution, self._law = by_geoms(model, rebounding(scene)), law_of(settings)
        self.most, self.apart, self.unsolved = 0, 0.0, 0

    def step2(self) -> None:
        """Make the second half of a step."""
        made, apart = matched_step2(self._mujoco, self._model, self._data, self._restitution, self._law)
        self.most, self.apart = max(self.most, made), max(self.apart, apart)
        ran_out = made == self._law[2] and not apart <= self._law[3]
        self.unsolved += ran_out or not apart <= SETTLED

    def told(self) -> dict[str, Any]:
        """Result of the rounds; a run with a step without agreement is no result of this profile."""
        found: dict[str, Any] = {"rounds": self.most, "shifts_apart": self.apart}
        if self.unsolved:
            steps = "step" if self.unsolved == 1 else "steps"
            reason = f"in {self.unsolved} {steps} the shifts of references do not converge: {self.apart:.2g} apart"
            found |= {"certified": False, "reasons": [reason]}
        return found
