"""Slips whose direction may turn, in space: what friction goes by, and ends that a step must not go over (E38)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.stepping.equalities import effect, list_rows, moves, row_value, solve_rows
from reference_solver.stepping.lasting import CONTACTS, LAST, ONWARD, OPEN, SLIP, START, TANGENTS, VELOCITIES, Lasting
from reference_solver.stepping.noise import FORCE_NOISE, LOCATED, NOISE

#: Cosine of the largest turn of a slip's direction between stages; one that turns farther comes to its end.
TURNED = 0.5
#: Rate at which slips may settle, times the step, inverse: Dormand and Prince's method is stable up to 3.3.
BEARABLE = 0.4
#: Share of what the more yielding body does that the other one does, below which what holds it still is asked for: that
#: is a solve of all rows. Above it c is ten times too large at most, and how fast a slow slip settles hangs on it only.
FAR_LIGHTER = 0.1
#: Rounds, at most, in search of a slip's direction or of its speed; change of a direction at which it is found.
ROUNDS, SETTLED = 16, 1e-12
#: An acceleration turns a slip no more than round-off does if this share of it is across.
STRAIGHT = 1e-6


@inner_kernel
def follow_slip(lasting: Lasting, k: int) -> None:
    """Direction of a slip that may turn; the last known of one that has all but ended, or turns round.

    A slip that comes to its end does not pass zero, but under friction along its last direction it does: what is along
    that changes sign at the end, as in the plane.
    """
    speed, onward = 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        speed += lasting.speed[k, 1 + t] ** 2
        onward += lasting.speed[k, 1 + t] * lasting.direction[k, t]
    speed = math.sqrt(speed)
    if speed > NOISE * lasting.speeds[k] and onward > TURNED * speed:
        for t in range(lasting.size[TANGENTS]):
            lasting.direction[k, t] = lasting.speed[k, 1 + t] / speed


@inner_kernel
def steady_slip(lasting: Lasting, k: int) -> bool:
    """Direction of a slip so slow that an explicit step cannot follow how friction turns it; False if it can.

    With f the tangential acceleration but for the contact's own friction, a slip u obeys ``u' = f - C u/|u|``: across
    f it dies out at the rate |C|/|u|, which has no bound where a slip begins (or ends) with f near what friction can
    do. Below the speed at which that rate is what the step can bear the direction is that of a backward step over a
    moment (`implicit_slip`) where no other contact holds its bodies, else that of u a moment later under f alone, as if
    C were a number: exact where the slip does not turn, and off by no more than it turns in that moment. What
    accelerates along its direction keeps it.
    """
    speed, force, size, onward = 0.0, 0.0, 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        gain = slip_gain(lasting, k, t)
        size += gain**2
        onward += gain * lasting.direction[k, t]
        speed += lasting.speed[k, 1 + t] ** 2
        force += removed(lasting, k, k, 1 + t) ** 2
    speed, force = math.sqrt(speed), math.sqrt(force)
    across, moment = math.sqrt(max(size - onward**2, 0.0)), lasting.length[0]
    if across * moment <= STRAIGHT * max(math.sqrt(size) * moment, speed) or speed >= BEARABLE * moment * force:
        return False
    if has_light_body(lasting, k):
        without_friction(lasting, k)
    else:
        for t in range(lasting.size[TANGENTS]):
            lasting.wanted[t] = slip_gain(lasting, k, t) + removed(lasting, k, k, 1 + t)
    push, force, along = 0.0, 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        push += lasting.wanted[t] ** 2
        force += (lasting.wanted[t] - slip_gain(lasting, k, t)) ** 2
        along += lasting.wanted[t] * lasting.speed[k, 1 + t]
    push, force = math.sqrt(push), math.sqrt(force)
    if force == 0.0 or speed >= BEARABLE * moment * force or push < TURNED * force:
        return False
    if speed > NOISE * lasting.speeds[k] and along < TURNED * push * speed:
        return False
    moment = BEARABLE * lasting.length[0] - speed / force
    if is_alone(lasting, k):
        x, y = implicit_slip(lasting, k, moment)
    else:
        x = lasting.speed[k, 1] + moment * lasting.wanted[0]
        y = lasting.speed[k, 2] + moment * lasting.wanted[1]
    size = math.sqrt(x**2 + y**2)
    if size == 0.0 or lasting.direction[k, 0] * x + lasting.direction[k, 1] * y < TURNED * size:  # it has ended
        return False
    lasting.direction[k, 0], lasting.direction[k, 1] = x / size, y / size
    return True


@inner_kernel
def is_alone(lasting: Lasting, k: int) -> bool:
    """Whether no other contact holds a body that moves of contact k: then its slip gives way as its own matrix says."""
    for other in range(lasting.size[CONTACTS]):
        if other == k or lasting.mode[other] == OPEN:
            continue
        for side in range(2):
            for own in range(2):
                if lasting.body[other, side] == lasting.body[k, own] and moves(lasting, k, own):
                    return False
    return True


@inner_kernel
def implicit_slip(lasting: Lasting, k: int, moment: float) -> tuple[float, float]:
    """Direction, a unit vector, of the slip of contact k a moment [s] later; (0, 0) if none is found.

    A backward step of ``u' = a + p (k_tn - mu K_tt d)``, with the pressure p that keeps the contact held:
    ``u + moment (a + p k_tn) = (r + moment p mu K_tt) d`` for the speed r >= 0 at which d is a unit vector, or r = 0
    where friction stops the slip within the moment. What gives way along one tangent more than along the other (a box
    on its corner) ends its slips along neither its acceleration nor its load.
    """
    mu = lasting.friction[k]
    nn, n1, n2 = compliance(lasting, k, 0, 0), compliance(lasting, k, 0, 1), compliance(lasting, k, 0, 2)
    c11, c12, c22 = compliance(lasting, k, 1, 1), compliance(lasting, k, 1, 2), compliance(lasting, k, 2, 2)
    d1, d2, pressed = lasting.direction[k, 0], lasting.direction[k, 1], lasting.force[k, 0]
    held = pressed * (nn - mu * (n1 * d1 + n2 * d2))
    a1 = slip_gain(lasting, k, 0) - pressed * (n1 - mu * (c11 * d1 + c12 * d2))
    a2 = slip_gain(lasting, k, 1) - pressed * (n2 - mu * (c12 * d1 + c22 * d2))
    for _ in range(ROUNDS):
        yields = nn - mu * (n1 * d1 + n2 * d2)
        if yields <= 0.0 or held <= 0.0:
            return 0.0, 0.0
        p = held / yields
        w1 = lasting.speed[k, 1] + moment * (a1 + p * n1)
        w2 = lasting.speed[k, 2] + moment * (a2 + p * n2)
        s = moment * p * mu
        r = speed_after(w1, w2, s * c11, s * c12, s * c22)
        m11, m12, m22 = r + s * c11, s * c12, r + s * c22
        x, y = m22 * w1 - m12 * w2, m11 * w2 - m12 * w1
        size = math.sqrt(x**2 + y**2)
        if size == 0.0:
            return 0.0, 0.0
        change = abs(x / size - d1) + abs(y / size - d2)
        d1, d2 = x / size, y / size
        if change <= SETTLED:
            break
    return d1, d2


@inner_kernel
def speed_after(w1: float, w2: float, c11: float, c12: float, c22: float) -> float:
    """Speed r >= 0 at which ``(r + C)^-1 w`` is a unit vector; 0 if it is shorter than one at every r.

    C is positive definite, so that the length falls with r; Newton on its inverse rises to the answer [More, Sorensen
    1983] from where C alone, at its largest, would leave it.
    """
    largest = 0.5 * (c11 + c22) + math.sqrt(0.25 * (c11 - c22) ** 2 + c12**2)
    r = max(math.sqrt(w1**2 + w2**2) - largest, 0.0)
    for _ in range(ROUNDS):
        m11, m22 = r + c11, r + c22
        det = m11 * m22 - c12**2
        if det <= 0.0:
            return r
        x, y = (m22 * w1 - c12 * w2) / det, (m11 * w2 - c12 * w1) / det
        size = math.sqrt(x**2 + y**2)
        if size <= 1.0 + SETTLED:
            return r
        falls = (x * (m22 * x - c12 * y) + y * (m11 * y - c12 * x)) / det
        r += size**2 / falls * (size - 1.0)
    return r


@inner_kernel
def compliance(lasting: Lasting, k: int, row: int, other: int) -> float:
    """Acceleration along one row of contact k by a unit of force along another, all else free [1/kg]."""
    total = 0.0
    for side in range(2):
        for d in range(lasting.size[VELOCITIES]):
            total += lasting.jacobian[k, side, row, d] * lasting.response[k, side, other, d]
    return total


@inner_kernel
def slip_gain(lasting: Lasting, k: int, t: int) -> float:
    """Rate of the slip of contact k along tangent t [m/s^2]."""
    return row_value(lasting, k, 1 + t, lasting.acceleration) + lasting.gamma[k, 1 + t]


@inner_kernel
def removed(lasting: Lasting, k: int, other: int, row: int) -> float:
    """What is gained along a row of another contact where the friction of contact k is taken away [m/s^2]."""
    total = 0.0
    for side in range(2):
        for own in range(2):
            if lasting.body[other, side] != lasting.body[k, own]:
                continue
            for d in range(lasting.size[VELOCITIES]):
                for t in range(lasting.size[TANGENTS]):
                    change = lasting.response[k, own, 1 + t, d] * lasting.force[k, 1 + t]
                    total -= lasting.jacobian[other, side, row, d] * change
    return total


@inner_kernel
def has_light_body(lasting: Lasting, k: int) -> bool:
    """Whether one body of contact k gives way to its friction far more than the other: if it is stuck it does not."""
    least, most = math.inf, 0.0
    for side in range(2):
        total = 0.0
        for row in range(1, 1 + lasting.size[TANGENTS]):
            share = 0.0
            for d in range(lasting.size[VELOCITIES]):
                for t in range(lasting.size[TANGENTS]):
                    change = lasting.response[k, side, 1 + t, d] * lasting.force[k, 1 + t]
                    share += lasting.jacobian[k, side, row, d] * change
            total += share**2
        if total > 0.0:  # a body that moves
            least, most = min(least, total), max(most, total)
    return least < FAR_LIGHTER**2 * most


@inner_kernel
def without_friction(lasting: Lasting, k: int) -> None:
    """Rates of the slip of contact k without its friction, in `Lasting.wanted`; all that is held still is."""
    kept = 0
    for i in range(list_rows(lasting)):
        other, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
        if other == k:  # its normal force is what it was
            continue
        lasting.unknown[kept, 0], lasting.unknown[kept, 1] = other, row
        lasting.right[kept] = -removed(lasting, k, other, row)
        kept += 1
    if kept > 0:
        solve_rows(lasting, kept, True, 0.0)
    for t in range(lasting.size[TANGENTS]):
        total = slip_gain(lasting, k, t) + removed(lasting, k, k, 1 + t)
        for i in range(kept):
            other, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
            for side in range(2):
                for own in range(2):
                    if lasting.body[other, side] != lasting.body[k, own]:
                        continue
                    for d in range(lasting.size[VELOCITIES]):
                        change = effect(lasting, True, other, side, row, d) * lasting.answer[i]
                        total += lasting.jacobian[k, own, 1 + t, d] * change
        lasting.wanted[t] = total


@inner_kernel
def stops_across(lasting: Lasting) -> bool:
    """Whether a slip that comes to its end along its last direction has turned, and goes on across it.

    How a slip turns while it ends is a power of the time left: a step over the end itself is of no order, steps that
    halve that time are. What is left in the end is round-off, and sticks.
    """
    for k in range(lasting.size[CONTACTS]):
        if lasting.mode[k] != SLIP or lasting.friction[k] == 0.0 or lasting.size[TANGENTS] == 1:
            continue
        if lasting.monitor[START, k, ONWARD] > FORCE_NOISE and lasting.monitor[LAST, k, ONWARD] <= LOCATED:
            speed, along = 0.0, 0.0
            for t in range(lasting.size[TANGENTS]):
                speed += lasting.speed[k, 1 + t] ** 2
                along += lasting.speed[k, 1 + t] * lasting.direction[k, t]
            if math.sqrt(max(speed - along**2, 0.0)) > NOISE * lasting.speeds[k]:
                return True
    return False
