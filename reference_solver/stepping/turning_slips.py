"""Slips whose direction may turn, in space: what friction goes by, and ends that a step must not go over (E38)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.equalities import (
    RANK,
    assemble,
    cluster_of,
    effect,
    factors_of,
    join_bodies,
    list_rows,
    row_change,
    row_value,
    solve_for,
)
from reference_solver.stepping.lasting import CONTACTS, LAST, ONWARD, SLIP, START, TANGENTS, VELOCITIES, Lasting
from reference_solver.stepping.noise import FORCE_NOISE, LOCATED, NOISE

#: Cosine of the largest turn of a slip's direction between stages; one that turns farther comes to its end.
TURNED = 0.5
#: Rate at which slips may settle, times the step, inverse: Dormand and Prince's method is stable up to 3.3.
BEARABLE = 0.4
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
def steady_slips(lasting: Lasting) -> bool:
    """Turn friction of all slips too slow for an explicit step; whether there are any, and which (`turned`)."""
    found = False
    for k in range(lasting.size[CONTACTS]):
        lasting.turned[k] = 0
        if lasting.mode[k] == SLIP and lasting.friction[k] > 0.0 and lasting.size[TANGENTS] > 1:
            lasting.turned[k] = 1 if steady_slip(lasting, k) else 0
            found = found or lasting.turned[k] == 1
    return found


@inner_kernel
def steady_slip(lasting: Lasting, k: int) -> bool:
    """Direction of a slip so slow that an explicit step cannot follow how friction turns it; False if it can.

    With f the tangential acceleration but for the contact's own friction, a slip u obeys ``u' = f - C u/|u|``: across
    f it dies out at the rate |C|/|u|, which has no bound where a slip begins (or ends) with f near what friction can
    do. Below the speed at which that rate is what the step can bear the direction is that of a backward step over a
    moment (`implicit_slip`). What accelerates along its direction keeps it.
    """
    speed, size, onward, rubs = 0.0, 0.0, 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        gain = slip_gain(lasting, k, t)
        size += gain**2
        onward += gain * lasting.direction[k, t]
        speed += lasting.speed[k, 1 + t] ** 2
        rubs += lasting.force[k, 1 + t] ** 2
    speed, rubs = math.sqrt(speed), math.sqrt(rubs)
    across, moment = math.sqrt(max(size - onward**2, 0.0)), lasting.length[0]
    yield_alone(lasting, k)
    brake = rubs * most_yield(lasting.gives)
    if across * moment <= STRAIGHT * max(math.sqrt(size) * moment, speed) or speed >= BEARABLE * moment * brake:
        return False
    yield_in_step(lasting, k)
    brake = rubs * most_yield(lasting.gives)
    push, force, along = 0.0, 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        slowed = 0.0
        for other in range(lasting.size[TANGENTS]):
            slowed += lasting.gives[1 + t, 1 + other] * lasting.force[k, 1 + other]
        wanted = slip_gain(lasting, k, t) - slowed
        push += wanted**2
        force += slowed**2
        along += wanted * lasting.speed[k, 1 + t]
    push, force = math.sqrt(push), math.sqrt(force)
    if brake <= 0.0 or speed >= BEARABLE * moment * brake or push < TURNED * force:
        return False
    if speed > NOISE * lasting.speeds[k] and along < TURNED * push * speed:
        return False
    x, y = implicit_slip(lasting, k, BEARABLE * moment - speed / brake)
    if lasting.direction[k, 0] * x + lasting.direction[k, 1] * y < TURNED:  # it has ended, or none is found
        return False
    lasting.direction[k, 0], lasting.direction[k, 1] = x, y
    return True


@inner_kernel
def implicit_slip(lasting: Lasting, k: int, moment: float) -> tuple[float, float]:
    """Direction, a unit vector, of the slip of contact k a moment [s] later; (0, 0) if none is found.

    A backward step of ``u' = a + p (k_tn - mu K_tt d)``, with the pressure p that keeps the contact held:
    ``u + moment (a + p k_tn) = (r + moment p mu K_tt) d`` for the speed r >= 0 at which d is a unit vector, or r = 0
    where friction stops the slip within the moment. What gives way along one tangent more than along the other (a box
    on its corner) ends its slips along neither its acceleration nor its load. Where others hold the normal as well the
    pressure is what it is.
    """
    mu, gives, pressed = lasting.friction[k], lasting.gives, lasting.force[k, 0]
    d1, d2 = lasting.direction[k, 0], lasting.direction[k, 1]
    alone = gives[0, 0] > RANK * passed_on(lasting, k, 0, k, 0)
    held = pressed * (gives[0, 0] - mu * (gives[0, 1] * d1 + gives[0, 2] * d2))
    a1 = slip_gain(lasting, k, 0) - pressed * (gives[1, 0] - mu * (gives[1, 1] * d1 + gives[1, 2] * d2))
    a2 = slip_gain(lasting, k, 1) - pressed * (gives[2, 0] - mu * (gives[2, 1] * d1 + gives[2, 2] * d2))
    for _ in range(ROUNDS):
        p = pressed
        if alone:
            yields = gives[0, 0] - mu * (gives[0, 1] * d1 + gives[0, 2] * d2)
            if yields <= 0.0 or held <= 0.0:
                return 0.0, 0.0
            p = held / yields
        w1 = lasting.speed[k, 1] + moment * (a1 + p * gives[1, 0])
        w2 = lasting.speed[k, 2] + moment * (a2 + p * gives[2, 0])
        s = moment * p * mu
        r = speed_after(w1, w2, s, gives)
        m11, m12, m21, m22 = r + s * gives[1, 1], s * gives[1, 2], s * gives[2, 1], r + s * gives[2, 2]
        x, y = m22 * w1 - m12 * w2, m11 * w2 - m21 * w1
        size = math.sqrt(x**2 + y**2)
        if size == 0.0:
            return 0.0, 0.0
        change = abs(x / size - d1) + abs(y / size - d2)
        d1, d2 = x / size, y / size
        if change <= SETTLED:
            break
    return d1, d2


@inner_kernel
def speed_after(w1: float, w2: float, s: float, gives: Array) -> float:
    """Speed r >= 0 at which ``(r + s K_tt)^-1 w`` is a unit vector; 0 if it is shorter than one at every r.

    K_tt is positive definite but for the friction of others, so that the length falls with r; Newton on its inverse
    rises to the answer [More, Sorensen 1983] from where K_tt alone, at its largest, would leave it.
    """
    c11, c12, c21, c22 = s * gives[1, 1], s * gives[1, 2], s * gives[2, 1], s * gives[2, 2]
    r = max(math.sqrt(w1**2 + w2**2) - s * most_yield(gives), 0.0)
    for _ in range(ROUNDS):
        m11, m22 = r + c11, r + c22
        det = m11 * m22 - c12 * c21
        if det <= 0.0:
            return r
        x, y = (m22 * w1 - c12 * w2) / det, (m11 * w2 - c21 * w1) / det
        size = math.sqrt(x**2 + y**2)
        if size <= 1.0 + SETTLED:
            return r
        falls = (x * (m22 * x - c12 * y) + y * (m11 * y - c21 * x)) / det
        if falls <= 0.0:
            return r
        r += size**2 / falls * (size - 1.0)
    return r


@inner_kernel
def yield_alone(lasting: Lasting, k: int) -> None:
    """Fill `Lasting.gives` with how contact k yields, all else free."""
    for row in range(1 + lasting.size[TANGENTS]):
        for column in range(1 + lasting.size[TANGENTS]):
            lasting.gives[row, column] = passed_on(lasting, k, column, k, row)


@inner_kernel
def most_yield(gives: Array) -> float:
    """Most that a unit of friction slows its slip along itself: the larger eigenvalue, of the symmetric part."""
    mean, half = 0.5 * (gives[1, 1] + gives[2, 2]), 0.5 * (gives[1, 1] - gives[2, 2])
    return mean + math.sqrt(half**2 + 0.25 * (gives[1, 2] + gives[2, 1]) ** 2)


@inner_kernel
def yield_in_step(lasting: Lasting, k: int) -> None:
    """Have `Lasting.gives`, where contact k yields alone, tell how it does with others, as when first asked in a step.

    Modes are the same throughout a step, and rows turn little; a step is repeated for dozens of lengths, with seven
    stages each.
    """
    if lasting.asked[k] == 0:
        yield_with_others(lasting, k)
    for row in range(1 + lasting.size[TANGENTS]):
        for column in range(1 + lasting.size[TANGENTS]):
            if lasting.asked[k] == 0:
                lasting.yields[k, row, column] = lasting.gives[row, column]
            lasting.gives[row, column] = lasting.yields[k, row, column]
    lasting.asked[k] = 1


@inner_kernel
def forget_yields(lasting: Lasting) -> None:
    """Begin a step anew: modes may be others."""
    for k in range(lasting.size[CONTACTS]):
        lasting.asked[k] = 0


@inner_kernel
def yield_with_others(lasting: Lasting, k: int) -> None:
    """Add to `Lasting.gives` what others do to contact k that hold on, stick and slip as they do."""
    rows, kept, pushed = 1 + lasting.size[TANGENTS], 0, False
    join_bodies(lasting)
    cluster = cluster_of(lasting, k)
    for i in range(list_rows(lasting)):
        other, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
        if other == k or cluster_of(lasting, other) != cluster:
            continue
        lasting.unknown[kept, 0], lasting.unknown[kept, 1] = other, row
        for column in range(rows):
            pushed = pushed or passed_on(lasting, k, column, other, row) != 0.0
        kept += 1
    if not pushed:
        return
    assemble(lasting, 0, kept, True)
    rank = factors_of(lasting, 0, kept)
    for column in range(rows):
        for i in range(kept):
            lasting.right[i] = -passed_on(lasting, k, column, lasting.unknown[i, 0], lasting.unknown[i, 1])
        solve_for(lasting, 0, kept, rank, 0.0)
        for i in range(kept):
            other, from_row, force = lasting.unknown[i, 0], lasting.unknown[i, 1], lasting.answer[i]
            for side in range(2):
                for d in range(lasting.size[VELOCITIES]):
                    lasting.change[d] = effect(lasting, True, other, side, from_row, d) * force
                for row in range(rows):
                    so_far = lasting.gives[row, column]
                    lasting.gives[row, column] = row_change(lasting, k, row, lasting.body[other, side], so_far)


@inner_kernel
def passed_on(lasting: Lasting, k: int, column: int, other: int, row: int) -> float:
    """Acceleration along a row of a contact, of k as well, by a unit of force along one of contact k [1/kg]."""
    total = 0.0
    for own in range(2):
        for d in range(lasting.size[VELOCITIES]):
            lasting.change[d] = lasting.response[k, own, column, d]
        total = row_change(lasting, other, row, lasting.body[k, own], total)
    return total


@inner_kernel
def slip_gain(lasting: Lasting, k: int, t: int) -> float:
    """Rate of the slip of contact k along tangent t [m/s^2]."""
    return row_value(lasting, k, 1 + t, lasting.acceleration) + lasting.gamma[k, 1 + t]


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
