"""What a step of a phase misses of its contacts: gaps, velocities of rows that are held, cones of friction."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.stepping.equalities import list_rows, push, solve_rows
from reference_solver.stepping.lasting import BODIES, CONTACTS, SLIP, STAGES, TANGENTS, VELOCITIES, Lasting
from reference_solver.stepping.noise import FROZEN
from reference_solver.stepping.operations import Bodies, displace, displacement_rate, evaluate, is_free

#: Times that friction is taken back into its cone: each leaves of an excess what normal impulses of this contact and of
#: others share with it. What is less than this share of friction is round-off of sums.
CONES, WITHIN = 24, 1e-12
#: Share of an excess that may be left of it: where more is, loads of redundant contacts pass it to and fro.
SHRINKS = 0.75

#: Largest impulse, over all that friction was more than its limits, at which rows are held again with the friction that
#: this brings along. Not far from one where levers are near each other's; more tells of a jam.
BRINGS = 4.0


@inner_kernel
def give(bodies: Bodies, lasting: Lasting, k: int, row: int, size: float) -> None:
    """Enter an impulse along a row of contact k: in world axes, its work, and that of surfaces that are moved."""
    if size == 0.0:
        return
    for d in range(lasting.impulse.shape[1]):
        lasting.impulse[k, d] += size * lasting.frame[k, row, d]
    axes, b = lasting.impulse.shape[1], lasting.body[k, 1]
    for d in range(lasting.moment.shape[1]):
        # The row's lever about the centre of B, and the centre's about the origin.
        first, second = ((d + 1) % 3, (d + 2) % 3) if axes == 3 else (0, 1)
        lever = bodies.pose[b, first] * lasting.frame[k, row, second]
        lever -= bodies.pose[b, second] * lasting.frame[k, row, first]
        lasting.moment[k, d] += size * (lever + lasting.jacobian[k, 1, row, axes + d])
    lasting.work[k, 0] += size * lasting.speed[k, row]
    for side in range(2):
        i = lasting.body[k, side]
        if not is_free(bodies, i):
            for d in range(lasting.size[VELOCITIES]):
                lasting.work[k, 1] -= size * lasting.jacobian[k, side, row, d] * bodies.twist[i, d]


@inner_kernel
def clean_up(bodies: Bodies, lasting: Lasting) -> bool:
    """Close the gaps of pressed contacts, and take out what velocities miss of their rows; both by M^-1 G^T."""
    evaluate(bodies, lasting)
    for _ in range(2):
        if not project(bodies, lasting, True, 0.0):
            return False
        evaluate(bodies, lasting)
    before = math.inf
    for _ in range(CONES if lasting.size[TANGENTS] > 1 else 0):
        excess = cone_excess(lasting)
        if excess == 0.0 or excess > SHRINKS * before:
            break
        before = excess
        keep_cones(bodies, lasting)
        evaluate(bodies, lasting)
        if not project(bodies, lasting, False, BRINGS * excess):
            return False
        evaluate(bodies, lasting)
    return project(bodies, lasting, False, 0.0)


@inner_kernel
def excess_of(lasting: Lasting, k: int) -> float:
    """What friction of slip k is more than mu p_n, along the tangents in ``wanted`` [N s]; 0 if it is not.

    At each stage it is mu p_n. But one of the weights of the stages is below zero: where directions differ, by the
    little that those of a slip near its end are known, the sum may be longer than its parts. Where normals turn that
    is not told from their turn.
    """
    if lasting.mode[k] != SLIP or lasting.friction[k] == 0.0 or turns_away(lasting, k):
        return 0.0
    pressed, size = 0.0, 0.0
    for d in range(lasting.normal.shape[1]):
        pressed += lasting.impulse[k, d] * lasting.frame[k, 0, d]
    for t in range(lasting.size[TANGENTS]):
        lasting.wanted[t] = 0.0
        for d in range(lasting.normal.shape[1]):
            lasting.wanted[t] += lasting.impulse[k, d] * lasting.frame[k, 1 + t, d]
        size += lasting.wanted[t] ** 2
    size = math.sqrt(size)
    excess = size - lasting.friction[k] * max(pressed, 0.0)
    if excess <= WITHIN * size:
        return 0.0
    for t in range(lasting.size[TANGENTS]):
        lasting.wanted[t] /= size
    return excess


@inner_kernel
def cone_excess(lasting: Lasting) -> float:
    """What friction of all slips that turn is more than mu p_n [N s]."""
    total = 0.0
    for k in range(lasting.size[CONTACTS]):
        total += excess_of(lasting, k)
    return total


@inner_kernel
def keep_cones(bodies: Bodies, lasting: Lasting) -> None:
    """Take back what friction of slips that turn is more than mu p_n, which moves rows that are held."""
    for k in range(lasting.size[CONTACTS]):
        excess = excess_of(lasting, k)
        for t in range(lasting.size[TANGENTS] if excess > 0.0 else 0):
            back = -excess * lasting.wanted[t]
            for side in range(2):
                i = lasting.body[k, side]
                for d in range(lasting.size[VELOCITIES] if is_free(bodies, i) else 0):
                    bodies.twist[i, d] += lasting.response[k, side, 1 + t, d] * back
            give(bodies, lasting, k, 1 + t, back)


@inner_kernel
def turns_away(lasting: Lasting, k: int) -> bool:
    """Whether the normal of contact k has turned since the phase began."""
    for d in range(lasting.normal.shape[1]):
        if abs(lasting.frame[k, 0, d] - lasting.normal[k, d]) > FROZEN:
            return True
    return False


@inner_kernel
def largest(lasting: Lasting, count: int) -> float:
    """Largest answer of the rows, of either sign; inf where one is no number."""
    most = 0.0
    for i in range(count):
        if not math.isfinite(lasting.answer[i]):
            return math.inf
        most = max(most, abs(lasting.answer[i]))
    return most


@inner_kernel
def project(bodies: Bodies, lasting: Lasting, poses: bool, most: float) -> bool:
    """Project poses on closed gaps, or velocities on the rows that are held.

    With the friction of slips, that one which is pressed more also slips at its limit, as far as no impulse of that
    exceeds ``most`` [N s]: near a jam what friction brings along has no bound. Else an orthogonal projection.
    """
    kept = list_rows(lasting)
    count = 0
    for i in range(kept):
        k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
        if poses and row > 0:
            continue
        lasting.unknown[count, 0], lasting.unknown[count, 1] = k, row
        lasting.right[count] = -lasting.gap[k] if poses else -lasting.speed[k, row]
        count += 1
    if count == 0:
        return True
    sliding = most > 0.0
    solve_rows(lasting, count, sliding, 0.0, False)
    if sliding and largest(lasting, count) > most:
        sliding = False
        solve_rows(lasting, count, False, 0.0, False)
    for i in range(lasting.size[BODIES]):
        for d in range(lasting.size[VELOCITIES]):
            lasting.acceleration[i, d] = 0.0
    for i in range(count):
        k, row, size = lasting.unknown[i, 0], lasting.unknown[i, 1], lasting.answer[i]
        push(lasting, lasting.acceleration, k, row, size)
        if not poses:
            give(bodies, lasting, k, row, size)
        if sliding and row == 0 and lasting.mode[k] == SLIP:
            for t in range(lasting.size[TANGENTS]):
                rubbed = -lasting.friction[k] * lasting.direction[k, t] * size
                push(lasting, lasting.acceleration, k, 1 + t, rubbed)
                give(bodies, lasting, k, 1 + t, rubbed)
    for i in range(lasting.size[BODIES]):
        if not is_free(bodies, i):
            continue
        for d in range(lasting.size[VELOCITIES]):
            if poses:
                lasting.spin[d], bodies.twist[i, d] = bodies.twist[i, d], lasting.acceleration[i, d]
            else:
                bodies.twist[i, d] += lasting.acceleration[i, d]
        if poses:
            displacement_rate(bodies, lasting, i, STAGES - 1)
            for d in range(lasting.size[VELOCITIES]):
                lasting.displacement[i, d] += lasting.rate[STAGES - 1, i, d]
                bodies.twist[i, d] = lasting.spin[d]
            displace(bodies, lasting, i)
    return True
