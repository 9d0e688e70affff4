"""A phase of lasting contact: one Dormand-Prince step with modes held, cut where the first of them ends."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.clean_up import clean_up, give
from reference_solver.stepping.equalities import (
    CONTRADICTORY,
    force_contacts,
)
from reference_solver.stepping.lasting import (
    BETWEEN,
    BODIES,
    CONTACTS,
    FAR,
    FEATURE,
    GONE,
    GRIP,
    HOPS,
    LAST,
    LOAD,
    NEAR,
    ONWARD,
    OPEN,
    SLIP,
    STAGES,
    START,
    STICK,
    TANGENTS,
    VELOCITIES,
    Lasting,
)
from reference_solver.stepping.modes import decide, friction_size, inverse_mass, normal_gain, set_slip
from reference_solver.stepping.noise import FORCE_NOISE, LOCATED
from reference_solver.stepping.operations import (
    Bodies,
    displace,
    displacement_curvature,
    displacement_rate,
    evaluate,
    feature_limits,
    free_accelerations,
    next_features,
)
from reference_solver.stepping.turning_slips import follow_slip, forget_yields, steady_slips, stops_across

# Coefficients of J. Dormand, P. Prince, J. Comput. Appl. Math. 6 (1980), RK5(4)7M.
#: Times of the stages, as shares of the step.
NODES = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
#: Row by row: weights of the slopes of earlier stages; the last row is the step itself.
COUPLINGS = np.array(
    (
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0),
        (3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0),
        (44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    )
)
#: Fifth order less embedded fourth order.
ERRORS = np.array((71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40))

#: Share of the translations that rotations are measured against at least, and the other way round.
NEXT_TO_NOTHING = 1e-4
#: Share of the length that the error would allow which is taken.
SAFETY = 0.8
#: Attempts to find a length whose error is small enough, and a step without a second change of modes inside.
LENGTHS = 24
#: Attempts more for each contact: it may begin to slip, stick, part, return and change its features, some of it twice.
CHANGES = 8
#: Steps in search of the end of a mode.
SEARCHES = 40
#: A monitor this far below zero at a stage, whose order is low, tells that a mode ends and begins again in between.
SURELY = 1e-6
#: Relative accuracy of that instant.
SAME_TIME = 1e-15
#: Shortest part of what is left that is stepped by this scheme: what needs shorter ones jams.
SHORTEST = 1e-9

#: Share of a phase after which the end of a feature is looked at for whether it comes nearer, and the share of the
#: extent by which it must be farther then: a hundred roundings.
GLANCE, GROWS = 1e-4, 1e-14
#: Share of the time to the end of a slip that turns which is stepped: what is left is a share of it as well.
BEFORE_END = 0.5

#: What a phase was: over all of its length; cut where a mode ended; cut because its error demanded it; not possible.
WHOLE, ENDED, SHORTENED, FAILED = 0, 1, 2, 3
#: Length of a phase where rows turn and none is found, or none is looked for.
NO_PHASE = -1.0


@inner_kernel
def evaluate_forces(bodies: Bodies, lasting: Lasting) -> bool:
    """Accelerations at the present state under the modes held."""
    evaluate(bodies, lasting)
    free_accelerations(bodies, lasting)
    for k in range(lasting.size[CONTACTS]):
        if lasting.mode[k] == SLIP and lasting.friction[k] > 0.0 and lasting.size[TANGENTS] > 1:
            follow_slip(lasting, k)
    if force_contacts(lasting, False) == CONTRADICTORY:
        return False
    return not steady_slips(lasting) or force_contacts(lasting, True) != CONTRADICTORY


@inner_kernel
def begin_phase(bodies: Bodies, lasting: Lasting) -> None:
    """Keep the state that the phase begins with."""
    for i in range(lasting.size[BODIES]):
        for d in range(lasting.base.shape[1]):
            lasting.base[i, d] = bodies.pose[i, d]
        for d in range(lasting.size[VELOCITIES]):
            lasting.before[i, d] = bodies.twist[i, d]
            lasting.displacement[i, d] = 0.0


@inner_kernel
def go_back(bodies: Bodies, lasting: Lasting) -> None:
    """Return to the start of the phase."""
    for i in range(lasting.size[BODIES]):
        for d in range(lasting.size[VELOCITIES]):
            bodies.twist[i, d] = lasting.before[i, d]
            lasting.displacement[i, d] = 0.0
        for d in range(lasting.base.shape[1]):
            bodies.pose[i, d] = lasting.base[i, d]
        displace(bodies, lasting, i)
    for k in range(lasting.size[CONTACTS]):
        for t in range(lasting.size[TANGENTS]):
            lasting.direction[k, t] = lasting.begun[k, t]


@inner_kernel
def keep_slopes(bodies: Bodies, lasting: Lasting, stage: int) -> None:
    """Rates of a stage."""
    for i in range(lasting.size[BODIES]):
        displacement_rate(bodies, lasting, i, stage)
        for d in range(lasting.size[VELOCITIES]):
            lasting.slope[stage, i, d] = lasting.acceleration[i, d]


@inner_kernel
def bend_paths(bodies: Bodies, lasting: Lasting, end: int) -> None:
    """Second derivatives of the displacements at one end of the phase."""
    for i in range(lasting.size[BODIES]):
        displacement_curvature(bodies, lasting, i, end)


@inner_kernel
def start_slopes(bodies: Bodies, lasting: Lasting) -> bool:
    """Stage 0: forces and monitors at the start of the phase under the modes held."""
    for k in range(lasting.size[CONTACTS]):
        for t in range(lasting.size[TANGENTS]):
            lasting.begun[k, t] = lasting.direction[k, t]
    forget_yields(lasting)
    go_back(bodies, lasting)
    if not evaluate_forces(bodies, lasting):
        return False
    for k in range(lasting.size[CONTACTS]):
        for d in range(lasting.normal.shape[1]):
            lasting.normal[k, d] = lasting.frame[k, 0, d]
    keep_slopes(bodies, lasting, 0)
    bend_paths(bodies, lasting, 0)
    watch(bodies, lasting, START)
    return True


@inner_kernel
def go_to_stage(bodies: Bodies, lasting: Lasting, stage: int, length: float) -> None:
    """Put all bodies where a stage of the step has them."""
    for i in range(lasting.size[BODIES]):
        moves = False
        for d in range(lasting.size[VELOCITIES]):
            way, gain = 0.0, 0.0
            for s in range(stage):
                way += COUPLINGS[stage, s] * lasting.rate[s, i, d]
                gain += COUPLINGS[stage, s] * lasting.slope[s, i, d]
            lasting.displacement[i, d] = length * way
            bodies.twist[i, d] = lasting.before[i, d] + length * gain
            moves = moves or way != 0.0
        if moves:
            displace(bodies, lasting, i)


@inner_kernel
def step_phase(bodies: Bodies, lasting: Lasting, length: float) -> float:
    """One step of ``length`` from the start of the phase, cleaned up; its `relative_error`, < 0 where rows fail.

    Leaves the end state in bodies, its monitors in place LAST, and in `Lasting.early` whether a stage in between found
    one below zero.
    """
    for k in range(lasting.size[CONTACTS]):
        for d in range(lasting.impulse.shape[1]):
            lasting.impulse[k, d] = 0.0
        for d in range(lasting.moment.shape[1]):
            lasting.moment[k, d] = 0.0
        lasting.work[k, 0] = lasting.work[k, 1] = 0.0
    lasting.length[0] = length
    forget_yields(lasting)
    weigh_stage(bodies, lasting, 0, length)
    keep_slopes(bodies, lasting, 0)
    lasting.early[0] = 1.0
    for stage in range(1, STAGES):
        go_to_stage(bodies, lasting, stage, length)
        if not evaluate_forces(bodies, lasting):
            return -1.0
        keep_slopes(bodies, lasting, stage)
        if stage < STAGES - 1:
            weigh_stage(bodies, lasting, stage, length)
            watch(bodies, lasting, BETWEEN)
            if lowest(lasting, BETWEEN, True)[0] < -SURELY:
                lasting.early[0] = min(lasting.early[0], NODES[stage])
    error = lasting.error[0] = relative_error(lasting, length)
    if not clean_up(bodies, lasting):
        return -1.0
    if not evaluate_forces(bodies, lasting):
        return -1.0
    keep_slopes(bodies, lasting, STAGES - 1)
    bend_paths(bodies, lasting, 1)
    watch(bodies, lasting, LAST)
    return error


@inner_kernel
def weigh_stage(bodies: Bodies, lasting: Lasting, stage: int, length: float) -> None:
    """Add the share of a stage to the impulses and the work of all contacts."""
    if stage == 0:
        go_back(bodies, lasting)
        evaluate_forces(bodies, lasting)
    weight = length * COUPLINGS[STAGES - 1, stage]
    for k in range(lasting.size[CONTACTS]):
        for row in range(1 + lasting.size[TANGENTS]):
            give(bodies, lasting, k, row, weight * lasting.force[k, row])


@inner_kernel
def relative_error(lasting: Lasting, length: float) -> float:
    """Largest difference of both orders over what bodies move, translations and rotations apart, over the accuracy.

    What moves next to nothing is measured against `NEXT_TO_NOTHING` of the other, at the size of the largest body that
    touches another, and of the reference speed of contacts: what is missed then is below `NOISE` of it.
    """
    split, size, least, speed = lasting.impulse.shape[1], 0.0, NEXT_TO_NOTHING, 0.0
    for k in range(lasting.size[CONTACTS]):
        size, speed = max(size, lasting.extent[k]), max(speed, lasting.speeds[k])
    if size == 0.0:  # free bodies
        size, least = 1.0, 0.0
    missed_way, moved_way = missed_and_moved(lasting, length, 0, split)
    missed_turn, moved_turn = missed_and_moved(lasting, length, split, lasting.size[VELOCITIES])
    way = max(moved_way, least * max(size * moved_turn, speed))
    turn = max(size * moved_turn, least * max(moved_way, speed))
    worst = 0.0
    if way > 0.0:
        worst = missed_way / (lasting.accuracy[0] * way)
    if turn > 0.0:
        worst = max(worst, size * missed_turn / (lasting.accuracy[0] * turn))
    return worst


@inner_kernel
def missed_and_moved(lasting: Lasting, length: float, first: int, last: int) -> tuple[float, float]:
    """Largest difference of both orders, of displacements and gains of velocity, and largest rate, of some entries.

    Where bodies touch translations are those seen from the first that does: in a world that moves as a whole the length
    of a phase is the same.
    """
    missed, moved, origin = 0.0, 0.0, -1
    if lasting.size[CONTACTS] > 0 and first == 0:
        origin = lasting.body[0, 0]
    for i in range(lasting.size[BODIES]):
        for d in range(first, last):
            way, gain = 0.0, 0.0
            for s in range(STAGES):
                way += ERRORS[s] * lasting.rate[s, i, d]
                gain += ERRORS[s] * lasting.slope[s, i, d]
                seen = lasting.rate[s, i, d] - (lasting.rate[s, origin, d] if origin >= 0 else 0.0)
                moved = max(moved, abs(seen))
            missed = max(missed, abs(way), length * abs(gain))
    return missed, moved


@inner_kernel
def watch(bodies: Bodies, lasting: Lasting, place: int) -> None:
    """Monitors of the evaluated state: none may fall below zero while modes are what they are."""
    for k in range(lasting.size[CONTACTS]):
        monitor = lasting.monitor[place, k]
        for m in range(len(monitor)):
            monitor[m] = math.inf
        if lasting.mode[k] == OPEN:
            continue
        share = inverse_mass(lasting, k, 0) / lasting.scale[k] if lasting.scale[k] > 0.0 else 0.0
        monitor[LOAD] = lasting.force[k, 0] * share
        if lasting.mode[k] == STICK:
            monitor[GRIP] = (lasting.friction[k] * lasting.force[k, 0] - friction_size(lasting, k)) * share
        elif lasting.friction[k] > 0.0:
            along = 0.0
            for t in range(lasting.size[TANGENTS]):
                along += lasting.speed[k, 1 + t] * lasting.direction[k, t]
            monitor[ONWARD] = along / lasting.speeds[k]
        weigh_limits(bodies, lasting, k, place)


@inner_kernel
def weigh_limits(bodies: Bodies, lasting: Lasting, k: int, place: int) -> None:
    """Monitors of the ends of features of contact k, as shares of its extent."""
    feature_limits(bodies, lasting, k, place)
    for m in range(FEATURE, lasting.monitor.shape[2]):
        lasting.monitor[place, k, m] /= lasting.extent[k]


@inner_kernel
def keep_limits(bodies: Bodies, lasting: Lasting) -> None:
    """Keep how far all contacts are from where their features end, at the start of a path."""
    for k in range(lasting.size[CONTACTS]):
        weigh_limits(bodies, lasting, k, START)


@inner_kernel
def passes_limit(bodies: Bodies, lasting: Lasting) -> bool:
    """Whether the features of any contact end between there and here: it goes on with others, or parts."""
    for k in range(lasting.size[CONTACTS]):
        weigh_limits(bodies, lasting, k, BETWEEN)
        for m in range(FEATURE, lasting.monitor.shape[2]):
            if lasting.monitor[START, k, m] >= -FORCE_NOISE and lasting.monitor[BETWEEN, k, m] < -FORCE_NOISE:
                return True
    return False


@inner_kernel
def lowest(lasting: Lasting, place: int, above: bool) -> tuple[float, int, int]:
    """Least monitor of those that were ``above`` zero at the start, or not; its contact and what it is."""
    least, which, what = math.inf, -1, LOAD
    for k in range(lasting.size[CONTACTS]):
        for m in range(lasting.monitor.shape[2]):
            if (lasting.monitor[START, k, m] > FORCE_NOISE) == above and lasting.monitor[place, k, m] < least:
                least, which, what = lasting.monitor[place, k, m], k, m
    return least, which, what


@inner_kernel
def rises_first(bodies: Bodies, lasting: Lasting, which: int, what: int, length: float) -> bool:
    """Whether the way to an end of a feature that has fallen below zero grows where the phase begins.

    A box that rocks leaves its edge by next to nothing, and comes back to it within the phase. Told by velocities and
    accelerations at the start; bodies are left where those take them in `GLANCE` of the phase.
    """
    go_back(bodies, lasting)
    for i in range(lasting.size[BODIES]):
        for d in range(lasting.size[VELOCITIES]):
            bend = 0.5 * GLANCE * length * lasting.bend[0, i, d]
            lasting.displacement[i, d] = GLANCE * length * (lasting.rate[0, i, d] + bend)
        displace(bodies, lasting, i)
    evaluate(bodies, lasting)
    weigh_limits(bodies, lasting, which, BETWEEN)
    return bool(lasting.monitor[BETWEEN, which, what] > max(lasting.monitor[START, which, what], 0.0) + GROWS)


@inner_kernel
def stops_at_once(lasting: Lasting) -> bool:
    """Whether a slip that is all but nothing ends: the projection that takes it out knows no cone.

    A frozen solve over an instant does (E54); where slip is left even after that, for rows that turn, it is round-off.
    """
    if lasting.lenient[0] > 0.0:
        return False
    for k in range(lasting.size[CONTACTS]):
        onward = lasting.monitor[LAST, k, ONWARD]
        if lasting.mode[k] == SLIP and lasting.friction[k] > 0.0:
            if lasting.monitor[START, k, ONWARD] <= FORCE_NOISE and onward < -FORCE_NOISE:
                return True
    return False


@inner_kernel
def end_mode(bodies: Bodies, lasting: Lasting, which: int, what: int) -> None:
    """Give contact ``which`` the mode that follows when monitor ``what`` falls below zero."""
    if what >= FEATURE:
        go_back(bodies, lasting)
        if not next_features(bodies, lasting, which):
            lasting.mode[which], lasting.parts[which] = OPEN, GONE
    elif what == LOAD:
        lasting.mode[which] = OPEN
    elif what == ONWARD:
        lasting.mode[which], lasting.slides[which] = STICK, 0
    else:
        go_back(bodies, lasting)
        evaluate_forces(bodies, lasting)
        set_slip(lasting, which)


@inner_kernel
def predict(lasting: Lasting, near: float, far: float) -> float:
    """First zero of the monitors that are below zero at the far end, along their chords."""
    first = far
    for k in range(lasting.size[CONTACTS]):
        for m in range(lasting.monitor.shape[2]):
            before, after = lasting.monitor[NEAR, k, m], lasting.monitor[FAR, k, m]
            if lasting.monitor[START, k, m] > FORCE_NOISE and after < 0.0:
                first = min(first, near + (far - near) * max(before, 0.0) / (max(before, 0.0) - after))
    return first


@inner_kernel
def keep_monitors(lasting: Lasting, source: int, target: int) -> None:
    """Copy all monitors."""
    for k in range(lasting.size[CONTACTS]):
        for m in range(lasting.monitor.shape[2]):
            lasting.monitor[target, k, m] = lasting.monitor[source, k, m]


@inner_kernel
def find_end(bodies: Bodies, lasting: Lasting, length: float) -> float:
    """Length of the step at whose end the first monitor is zero, below which it is not; < 0 where rows fail.

    `step_phase` of ``length`` has found one below zero. Chords between brackets (regula falsi, the kept end's value
    halved where it is kept twice, as in the Illinois method), each evaluated by a step of its own; one whose error is
    too large ends the search.
    """
    near, far = 0.0, length
    keep_monitors(lasting, START, NEAR)
    keep_monitors(lasting, LAST, FAR)
    kept = 0
    for _ in range(SEARCHES):
        guess = predict(lasting, near, far)
        if not (near < guess < far):
            guess = 0.5 * (near + far)
        if far - near <= SAME_TIME * far or guess <= near or guess >= far or far < SHORTEST * length:
            break
        if step_phase(bodies, lasting, guess) < 0.0:
            return -1.0
        if lasting.size[TANGENTS] > 1 and lasting.error[0] > 1.0:
            return guess  # a slip turns on its way to its end
        value, _, _ = lowest(lasting, LAST, True)
        if abs(value) <= LOCATED:
            return guess
        if value < 0.0:
            keep_monitors(lasting, LAST, FAR)
            far = guess
            kept = kept + 1 if kept > 0 else 1
            if kept > 1:
                soften(lasting, NEAR)
        else:
            keep_monitors(lasting, LAST, NEAR)
            near = guess
            kept = kept - 1 if kept < 0 else -1
            if kept < -1:
                soften(lasting, FAR)
    if step_phase(bodies, lasting, far) < 0.0:
        return -1.0
    return far


@inner_kernel
def soften(lasting: Lasting, place: int) -> None:
    """Halve what is kept of one end of a bracket."""
    for k in range(lasting.size[CONTACTS]):
        for m in range(lasting.monitor.shape[2]):
            lasting.monitor[place, k, m] *= 0.5


@inner_kernel
def first_return(lasting: Lasting, left: float) -> float:
    """Until when contacts that part by less than what is seen of a gap have come back, ``left`` at most [s].

    Held from the start they would be pulled. They fly, and land with the speed that they left with: an impact, whose
    law knows cone and sign.
    """
    first = left
    for k in range(lasting.size[CONTACTS]):
        gain = normal_gain(lasting, k)
        if lasting.parts[k] == HOPS and gain < 0.0:
            first = min(first, -2.0 * lasting.speed[k, 0] / gain)
    return first


@inner_kernel
def start_again(bodies: Bodies, lasting: Lasting) -> bool:
    """Begin with modes that have changed, and close what was open under those before; False where rows fail."""
    for _ in range(lasting.size[CONTACTS]):
        if not start_slopes(bodies, lasting):
            return False
        which, worst = -1, -FORCE_NOISE
        for k in range(lasting.size[CONTACTS]):
            if lasting.mode[k] == OPEN and lasting.parts[k] == 0:
                closes = normal_gain(lasting, k) / lasting.scale[k] if lasting.scale[k] > 0.0 else 0.0
                if closes < worst:
                    which, worst = k, closes
        if which < 0:
            return True
        lasting.mode[which] = SLIP if lasting.slides[which] == 1 or lasting.friction[which] == 0.0 else STICK
    return start_slopes(bodies, lasting)


@inner_kernel
def find_phase(bodies: Bodies, lasting: Lasting, left: float) -> tuple[float, int]:
    """Go from the present state to the end of a phase of lasting contact, within ``left``; its length and what it was.

    Contacts have been noted (`hold`). Bodies are at the end of the phase afterwards, or where they were if it FAILED.
    """
    begin_phase(bodies, lasting)
    evaluate(bodies, lasting)
    free_accelerations(bodies, lasting)
    changed = decide(lasting)
    if not changed:
        go_back(bodies, lasting)
        return 0.0, FAILED
    length, outcome = left, WHOLE
    for _ in range(LENGTHS + CHANGES * lasting.size[CONTACTS]):
        if changed:
            if not start_again(bodies, lasting):
                break
            back = first_return(lasting, length)
            if back < length:
                length, left, outcome = back, back, SHORTENED
            changed = False
        error = step_phase(bodies, lasting, length)
        later, _, _ = lowest(lasting, LAST, True)
        at_once, which, what = lowest(lasting, LAST, False)
        if error < 0.0:
            length, outcome = 0.25 * length, SHORTENED
        elif error > 1.0:
            parts = math.ceil(max(error, 1.0) ** 0.2 / SAFETY)
            length, outcome = length / max(parts, 2), SHORTENED
        elif stops_at_once(lasting):
            break
        elif at_once < -FORCE_NOISE:
            if what >= FEATURE and length > SHORTEST * left and rises_first(bodies, lasting, which, what, length):
                length, outcome = 0.25 * length, SHORTENED
                continue
            end_mode(bodies, lasting, which, what)
            changed = True
            continue
        elif lasting.early[0] < 1.0 and later >= 0.0:
            length, outcome = lasting.early[0] * length, SHORTENED
        elif later < -LOCATED:
            end = find_end(bodies, lasting, length)
            if end >= SHORTEST * left:
                settled = not stops_across(lasting) and lasting.error[0] <= 1.0
                if settled or BEFORE_END * end < SHORTEST * left:
                    return end, ENDED
                length, outcome = BEFORE_END * end, SHORTENED
                continue
            if end < 0.0:
                break
            # As soon as the phase has begun: gaps that were open by round-off are closed by then.
            later, which, what = lowest(lasting, LAST, True)
            if later < 0.0:
                end_mode(bodies, lasting, which, what)
            changed = True
        else:
            return length, outcome
        if length < SHORTEST * left:
            break
    go_back(bodies, lasting)
    return 0.0, FAILED


@inner_kernel
def write_path(lasting: Lasting, i: int, length: float, coefficient: Array) -> None:
    """Coefficients (V, 6) of the quintic with place, rate and second derivative of body i at both ends."""
    for d in range(lasting.size[VELOCITIES]):
        rate, bend = lasting.rate[0, i, d], lasting.bend[0, i, d]
        way = lasting.displacement[i, d] - length * (rate + 0.5 * length * bend)
        gain = length * (lasting.rate[STAGES - 1, i, d] - rate - length * bend)
        turn = length * length * (lasting.bend[1, i, d] - bend)
        coefficient[d, 0], coefficient[d, 1], coefficient[d, 2] = 0.0, rate, 0.5 * bend
        coefficient[d, 3] = (10.0 * way - 4.0 * gain + 0.5 * turn) / length**3
        coefficient[d, 4] = (-15.0 * way + 7.0 * gain - turn) / length**4
        coefficient[d, 5] = (6.0 * way - 3.0 * gain + 0.5 * turn) / length**5
