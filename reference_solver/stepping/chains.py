"""Impacts that follow each other in one instant, and chains of them that have no end (E21, E22).

A pair of bodies that parts has no part in an impact. One lies that carried load until now: its normal has turned. So
does one with e = 0 that drifts apart, slower than a millionth of the impact. What the impact drives together again is
struck next, in the same instant: its gap is round-off, and so is the time until it is closed. Where one pair of bodies
meets and all others that touch them part, the order of impacts is forced. Without friction each then changes the normal
velocities u by a linear map, ``u -> u - (1 + e_j) u_j W_j/W_jj`` with ``W = J M^-1 J^T``, which needs no bodies: a
chain is followed here to see whether it ends. It does not if the order repeats, with all u a factor below one smaller
each time.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.clock import BLOWS, HELD, SOON, UNORDERED
from reference_solver.stepping.impacts import CHAIN_ENDS, PARTS
from reference_solver.stepping.islands import first_of
from reference_solver.stepping.lasting import VELOCITIES, Lasting
from reference_solver.stepping.noise import DRIFT, NOISE
from reference_solver.stepping.operations import Island, ending_of, is_free, mark_contact, note_touching, number_of
from reference_solver.tally import ENDLESS_A, ENDLESS_B

#: Values of `Lasting.mode` of contacts that are noted for an impact.
MEETS, LIES, LEAVES = 0, 1, 2
#: Impacts of one instant, or followed by their maps, after which a chain whose end is not foreseen is broken off: one
#: that takes a hundredth of all speeds each time has left 1e-13 of them after 3000.
MOST_BLOWS = 4096
#: Cycles through which a disturbance of a chain is followed, and how many times it may grow over the chain's own
#: velocities: from round-off it stays far below `CLEAR` then.
CYCLES, GROWS = 1000, 1e3
#: Share by which velocities may miss a multiple of those of the cycle before; and share of the largest velocity that
#: each must have, so that what is missed leaves the order as it is.
SAME, CLEAR = 1e-10, 1e-6
#: Sweeps over the contacts of one pair that are struck together, and the share of the largest velocity that they leave.
SWEEPS, SOLVED = 200, 1e-14


@inner_kernel
def open_instant(island: Island) -> None:
    """Say which of the contacts that touch have no part in the impact of now, and which end a chain of impacts.

    By clusters of contacts that share free bodies. At impulse level all take part (E28).
    """
    lasting, clock = island.sub.lasting, island.sub.clock
    clock[UNORDERED] = 0.0
    count = note_touching(island) if clock[HELD] == 0.0 else 0
    meets, parts = 0, 0
    for k in range(count):
        u, least = lasting.speed[k, 0], lasting.speeds[k]
        lasting.mode[k] = MEETS if u < -least else LEAVES if u > least else LIES
    for k in range(count):
        for j in range(count if lasting.mode[k] == LEAVES else 0):
            if lasting.mode[j] == MEETS and same_pair(lasting, j, k):
                lasting.mode[k] = LIES  # all points of a pair that meets answer together
        meets += 1 if lasting.mode[k] == MEETS else 0
        parts += 1 if lasting.mode[k] == LEAVES else 0
    if meets == 0 or parts == 0:
        return
    join_contacts(island, count)
    for i in range(len(lasting.label)):
        members = list_cluster(island, i, count)
        met, pairs, parts, rubs, fastest = -1, 0, 0, False, 0.0
        for m in range(members):
            k = lasting.order[m]
            rubs = rubs or lasting.friction[k] > 0.0
            if lasting.mode[k] == MEETS:
                fastest = max(fastest, -lasting.speed[k, 0])
                pairs += 1 if met < 0 or not same_pair(lasting, met, k) else 0
                met = k
        for m in range(members):
            k, u = lasting.order[m], lasting.speed[lasting.order[m], 0]
            # What does not rebound parts only as it turns, or drifts; what a chain has left of a speed is none.
            if lasting.mode[k] == LEAVES and u <= (DRIFT if lasting.usual[k, 0] == 0.0 else NOISE) * fastest:
                lasting.mode[k] = LIES
            parts += 1 if lasting.mode[k] == LEAVES else 0
        if met < 0 or parts == 0:
            continue
        if pairs > 1 and (clock[SOON] > 0.0 or clock[BLOWS] > 0.0):
            clock[UNORDERED] = 1.0
        broken_off = clock[BLOWS] >= MOST_BLOWS
        if broken_off:
            name_bodies(island, met)
        endless = not broken_off and pairs == 1 and not rubs and accumulates(lasting, members)
        for m in range(members):
            k = lasting.order[m]
            if broken_off or (endless and lasting.asked[m] == 1):
                mark_contact(island, k, CHAIN_ENDS)
            elif lasting.mode[k] == LEAVES:
                mark_contact(island, k, PARTS)


@inner_kernel
def strikes_again(island: Island) -> bool:
    """Whether the impact drove a contact together that had no part in it."""
    lasting = island.sub.lasting
    count = note_touching(island) if island.sub.clock[HELD] == 0.0 else 0
    found, ended = -1, False
    for k in range(count):
        ending = ending_of(island, k)
        ended = ended or ending == CHAIN_ENDS
        if ending == PARTS and lasting.speed[k, 0] < -lasting.speeds[k]:
            found = k
    if found >= 0 and ended:  # it would have been struck before the chain had ended
        name_bodies(island, found)
    return found >= 0


@inner_kernel
def name_bodies(island: Island, k: int) -> None:
    """Enter the bodies of noted contact k in the tally, unless others are named there."""
    tally, body = island.tally, island.sub.lasting.body
    if tally[ENDLESS_A] == 0.0:
        tally[ENDLESS_A], tally[ENDLESS_B] = 1.0 + number_of(island, body[k, 0]), 1.0 + number_of(island, body[k, 1])


@inner_kernel
def join_contacts(island: Island, count: int) -> None:
    """Label free bodies that touch each other, directly or through others, by the lowest of them."""
    label, body = island.sub.lasting.label, island.sub.lasting.body
    for i in range(len(label)):
        label[i] = i
    for k in range(count):
        if is_free(island, body[k, 0]) and is_free(island, body[k, 1]):
            a, b = first_of(label, body[k, 0]), first_of(label, body[k, 1])
            label[max(a, b)] = min(a, b)


@inner_kernel
def list_cluster(island: Island, i: int, count: int) -> int:
    """List the contacts of the cluster with the label i in ``lasting.order``; how many there are."""
    lasting, members = island.sub.lasting, 0
    for k in range(count):
        own = lasting.body[k, 0] if is_free(island, lasting.body[k, 0]) else lasting.body[k, 1]
        if first_of(lasting.label, own) == i:
            lasting.order[members] = k
            members += 1
    return members


@inner_kernel
def same_pair(lasting: Lasting, j: int, k: int) -> bool:
    """Whether two noted contacts are of the same bodies."""
    return bool(lasting.body[j, 0] == lasting.body[k, 0] and lasting.body[j, 1] == lasting.body[k, 1])


@inner_kernel
def accumulates(lasting: Lasting, n: int) -> bool:
    """Whether impacts of the n contacts listed, which have no friction, have no end but one in time (E22).

    ``lasting.asked`` is then 1 for those of the cycle, in the order of the list. Each impact must be of one pair, and
    all other contacts part clearly, but for what lies across the row and feels nothing; gaps, of which multiples are
    followed, must shrink more from cycle to cycle than velocities do; and a disturbance of the velocities must not grow
    against them.
    """
    for i in range(n):
        lasting.asked[i] = 0
    n = leave_out_lying(lasting, n)
    u, gap, before, gap_before = lasting.right, lasting.answer, lasting.spare, lasting.other
    for i in range(n):
        u[i], gap[i] = lasting.speed[lasting.order[i], 0], 1.0
        before[i], gap_before[i] = u[i], gap[i]
    made, window = 0, 1
    for _ in range(MOST_BLOWS):
        if not strike(lasting, u, gap, n):
            return False
        made += 1
        if is_multiple(lasting, u, before, n):
            shrinks = largest_of(lasting, u, n) / largest_of(lasting, before, n)
            for i in range(n):
                if lasting.asked[i] == 1 and gap[i] > 0.0 and not gap[i] < shrinks * gap_before[i]:
                    return False
            return shrinks < 1.0 - SAME and stays_small(lasting, u, gap, n, made)
        if made == window:
            scale_down(lasting, u, n)
            scale_down(lasting, gap, n)
            made, window = 0, 2 * window
            for i in range(n):
                before[i], gap_before[i], lasting.asked[i] = u[i], gap[i], 0
    return False


@inner_kernel
def leave_out_lying(lasting: Lasting, n: int) -> int:
    """List contacts that lie, and that impulses of no other one move, last; fill the map of the others: how many.

    What lies and is moved stays among them.
    """
    fill_map(lasting, n)
    for i in range(n - 1, -1, -1):
        k, moved = lasting.order[i], False
        for j in range(n):
            if j != i and lasting.mode[lasting.order[j]] != LIES:
                moved = moved or abs(lasting.matrix[i, j]) > SAME * (lasting.matrix[i, i] + lasting.matrix[j, j])
        if lasting.mode[k] == LIES and not moved:
            n -= 1
            lasting.order[i], lasting.order[n] = lasting.order[n], k
            fill_map(lasting, n)
    return n


@inner_kernel
def fill_map(lasting: Lasting, n: int) -> None:
    """Fill ``lasting.matrix`` with W of the normal rows of the contacts listed [1/kg]."""
    for i in range(n):
        for j in range(n):
            k, m, total = lasting.order[i], lasting.order[j], 0.0
            for side in range(2):
                for other in range(2):
                    if lasting.body[k, side] == lasting.body[m, other]:
                        for d in range(lasting.size[VELOCITIES]):
                            total += lasting.jacobian[k, side, 0, d] * lasting.response[m, other, 0, d]
            lasting.matrix[i, j] = total


@inner_kernel
def strike(lasting: Lasting, u: Array, gap: Array, n: int) -> bool:
    """Go to the next impact of the contacts listed and make it; False where there is none, or none alone is next.

    ``lasting.turned`` is 1 for the contacts struck; ``asked`` becomes so.
    """
    clear, first = 0.0, -1
    for i in range(n):
        clear = max(clear, CLEAR * abs(u[i]))
    for i in range(n):
        if abs(u[i]) <= clear:
            return False
        lasting.turned[i] = 1 if u[i] < 0.0 else 0
        if lasting.turned[i] == 1:
            if first >= 0 and not same_pair(lasting, lasting.order[first], lasting.order[i]):
                return False
            first, lasting.asked[i] = i, 1
    if first < 0:
        return False
    for i in range(n):
        if u[i] > 0.0 and same_pair(lasting, lasting.order[first], lasting.order[i]):
            return False  # not linear: its points answer together, and may part
    time = gap[first] / -u[first]
    for i in range(n):
        gap[i] = 0.0 if lasting.turned[i] == 1 else gap[i] + time * u[i]
    rebound(lasting, u, n, True)
    return True


@inner_kernel
def rebound(lasting: Lasting, u: Array, n: int, clamps: bool) -> None:
    """Change velocities u of the contacts listed by an impact of those of ``lasting.turned``: their u becomes -e u."""
    largest = largest_of(lasting, u, n)
    for i in range(n):
        lasting.weight[i], lasting.scale[i] = -lasting.usual[lasting.order[i], 0] * u[i], 0.0
    for _ in range(SWEEPS):
        missed = 0.0
        for i in range(n):
            if lasting.turned[i] == 0:
                continue
            push = lasting.scale[i] + (lasting.weight[i] - u[i]) / lasting.matrix[i, i]
            push = max(push, 0.0) if clamps else push
            change, lasting.scale[i] = push - lasting.scale[i], push
            missed = max(missed, abs(change) * lasting.matrix[i, i])
            for j in range(n):
                u[j] += change * lasting.matrix[j, i]
        if missed <= SOLVED * largest:
            break


@inner_kernel
def largest_of(lasting: Lasting, values: Array, n: int) -> float:
    """Largest of the values of the contacts listed that have been struck; of all where none has."""
    largest, whole = 0.0, 0.0
    for i in range(n):
        whole = max(whole, abs(values[i]))
        largest = max(largest, abs(values[i]) if lasting.asked[i] == 1 else 0.0)
    return largest if largest > 0.0 else whole


@inner_kernel
def scale_down(lasting: Lasting, values: Array, n: int) -> None:
    """Divide values by their largest."""
    largest = largest_of(lasting, values, n)
    for i in range(n if largest > 0.0 else 0):
        values[i] /= largest


@inner_kernel
def is_multiple(lasting: Lasting, one: Array, other: Array, n: int) -> bool:
    """Whether values of the contacts that have been struck are a multiple of other ones, to round-off."""
    first, second = largest_of(lasting, one, n), largest_of(lasting, other, n)
    same = first > 0.0 and second > 0.0
    for i in range(n if same else 0):
        if lasting.asked[i] == 1:
            same = same and abs(one[i] / first - other[i] / second) <= SAME
    return same


@inner_kernel
def stays_small(lasting: Lasting, u: Array, gap: Array, n: int, cycle: int) -> bool:
    """Whether a disturbance of the velocities u of a chain does not outgrow them; in a cycle are ``cycle`` impacts.

    It is one that impulses of all contacts make, each another one.
    """
    shaken, grown = lasting.spare, 1.0
    for i in range(n):
        shaken[i] = 0.0
        for j in range(n):
            shaken[i] += lasting.matrix[i, j] * (1.0 + 0.618 * j) / lasting.matrix[j, j]
    for _ in range(CYCLES):
        scale_down(lasting, shaken, n)
        scale_down(lasting, u, n)
        scale_down(lasting, gap, n)
        for _ in range(cycle):
            if not strike(lasting, u, gap, n):
                return False
            rebound(lasting, shaken, n, False)
        grown *= largest_of(lasting, shaken, n) / largest_of(lasting, u, n)
        if not 0.0 < grown <= GROWS:
            break
    return grown <= GROWS
