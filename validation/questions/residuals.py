r"""Residuals of the contact laws, from the impulses that an engine reports, contact by contact, step by step.

    pull          p_n >= 0                 contacts push
    cone          |p_t| <= mu p_n          Coulomb's disc
    separation    p_n (u_n + e u_n-) = 0   loaded contacts do not separate, separating ones carry no load (Newton's law)
    slip          p_t . (u_t + u_t-)/2 <= 0    friction dissipates energy
    momentum      m (v - v-) = F dt + sum p    reported impulses are those that act

p: impulse of the step on the second body; u-, u: relative velocity of the two bodies at the contact before and after
the step; n from the first to the second. Impulses are relative to the largest one of the run, works to that impulse
times the largest relative speed at a contact (at least that of one step's fall): dimensionless, so that scenes and
engines can be compared. Soft contacts, pyramids and unconverged iterations have residuals by design.

Where an engine reports no impulses there is a reason instead of a value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.isolation.foreign import checked_refusal, said_by
from adapters.registry import load
from adapters.scene import Scene
from adapters.stepping import posed_for, run
from adapters.trajectory import Measured, Trajectory
from validation.cells import Slot, settings_of
from validation.posed import resolve
from validation.running.apart import Apart

#: Indices, as contact records have them.
Whole = NDArray[np.int64]
#: The residuals, in order, and their laws.
LAWS = {
    "pull": "contacts push: p_n >= 0",
    "cone": "|p_t| <= mu p_n",
    "separation": "p_n (u_n + e u_n-) = 0",
    "slip": "friction dissipates energy: p_t . (u_t + u_t-)/2 <= 0",
    "momentum": "m (v - v-) = F dt + sum p",
}


@dataclass(frozen=True)
class Residuals:
    """Largest residual of each law over a run, as shares; ``refused`` is the reason where there are none."""

    slot: Slot
    values: dict[str, Measured]
    contacts: int = 0
    refused: str = ""


def residuals(scene: Scene, found: Trajectory) -> tuple[dict[str, Measured], int]:
    """Largest residual of each law, and the number of contacts; contacts recorded from the first step on."""
    record = found.contacts
    if record is None:
        return _nothing("the engine reports no contacts"), 0
    rows = record.rows
    if len(rows.a) == 0:
        return _nothing("nothing touched"), 0
    if np.isnan(rows.impulse).any():
        return _nothing("the engine does not report impulses"), len(rows.a)
    sample = np.repeat(record.step, np.diff(record.offset))
    before, after = (_relative(found, rows.a, rows.b, rows.point, sample - k) for k in (1, 0))
    normal = rows.normal
    names = [body.name for body in scene.bodies]
    pairs = sorted({(int(a), int(b)) for a, b in zip(rows.a, rows.b, strict=True)})
    material = {pair: scene.material(names[pair[0]], names[pair[1]]) for pair in pairs}
    mu = np.array([material[int(a), int(b)].friction for a, b in zip(rows.a, rows.b, strict=True)])
    e = np.array([material[int(a), int(b)].restitution for a, b in zip(rows.a, rows.b, strict=True)])

    pn = _dot(rows.impulse, normal)
    pt = rows.impulse - pn[:, None] * normal
    un, un_before = _dot(after, normal), _dot(before, normal)
    slip = 0.5 * (after + before)
    run = np.array([body.surface_velocity for body in scene.bodies])
    slip = slip + run[rows.b] - run[rows.a]
    slip = slip - _dot(slip, normal)[:, None] * normal
    largest = float(np.abs(rows.impulse).max())
    fall = math.hypot(*scene.gravity) * found.dt
    fastest = float(np.maximum(np.linalg.norm(np.concatenate([before, after]), axis=1).max(), fall))
    if largest == 0.0:
        return _nothing("no contact carried a load"), len(rows.a)
    work = largest * fastest
    push = np.maximum(pn, 0.0)
    numbers = {
        "pull": np.maximum(-pn, 0.0).max() / largest,
        "cone": np.maximum(np.linalg.norm(pt, axis=1) - mu * push, 0.0).max() / largest,
        "separation": np.abs(push * (un + e * np.minimum(un_before, 0.0))).max() / work if work else 0.0,
        "slip": np.maximum(_dot(pt, slip), 0.0).max() / work if work else 0.0,
        "momentum": _momentum(scene, found, sample) / largest,
    }
    said = "a contact's point, normal or impulse is not a number"
    told: dict[str, Measured] = {
        name: (float(value), "") if math.isfinite(value) else (None, said) for name, value in numbers.items()
    }
    return told, len(rows.a)


def _nothing(reason: str) -> dict[str, Measured]:
    return dict.fromkeys(LAWS, (None, reason))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ki,ki->k", a, b))


def _relative(found: Trajectory, a: Whole, b: Whole, point: Array, sample: Whole) -> Array:
    """Velocity of body b over body a at points, (k, d) [m/s]."""
    return _velocity(found, b, point, sample) - _velocity(found, a, point, sample)


def _velocity(found: Trajectory, body: Whole, point: Array, sample: Whole) -> Array:
    d = found.dimension
    arm = point - found.pose[sample, body, :d]
    twist = found.twist[sample, body]
    if d == 2:
        turned = np.stack([-twist[:, 2] * arm[:, 1], twist[:, 2] * arm[:, 0]], axis=1)
    else:
        turned = np.cross(twist[:, 3:], arm)
    return np.asarray(twist[:, :d] + turned)


def _momentum(scene: Scene, found: Trajectory, sample: Whole) -> float:
    """Largest change of a free body's momentum in a step beyond loads and reported impulses [N s]."""
    record, d = found.contacts, scene.dimension
    assert record is not None
    total = np.zeros((len(found.t), len(scene.bodies), d))
    np.add.at(total, (sample, record.rows.b), record.rows.impulse)
    np.subtract.at(total, (sample, record.rows.a), record.rows.impulse)
    worst = 0.0
    for k, body in enumerate(scene.bodies):
        if body.motion == "free":
            load = body.mass * np.array(scene.gravity) + np.array(body.force)
            change = body.mass * np.diff(found.twist[:, k, :d], axis=0)
            off = np.linalg.norm(change - load * found.dt - total[1:, k], axis=1)
            worst = float(np.maximum(worst, off.max()))  # Python's max skips NaN
    return worst


def measured(slot: Slot) -> Residuals:
    """Residuals of a cell; runs in this process."""
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    try:
        engine = load(slot.engine)
        refusal = checked_refusal(engine.refusal(posed_for(engine, scene), slot.base, slot.dt))
        if refusal:
            return Residuals(slot, _nothing(refusal), refused=refusal)
        settings = {setting.name: setting.value for setting in settings_of(engine, slot, scene)}
        sampling = replace(canonical.sampling(scene), stride=1, contacts_from=0.0)
        found = run(engine, scene, slot.dt, settings, sampling)
        return Residuals(slot, *residuals(scene, found))
    except BaseException as error:  # an engine may raise anything; only this result is lost
        return Residuals(slot, _nothing(said_by(error)), refused=said_by(error))


def ask(slot: Slot, apart: Apart) -> Residuals:
    """Residuals of a cell, from a separate process."""
    answer = apart.ask(measured, slot)
    return Residuals(slot, _nothing(answer), refused=answer) if isinstance(answer, str) else answer
