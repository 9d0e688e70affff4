"""Which contacts of an instant part, stick or slip: the contact problem of accelerations (E38)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.stepping.equalities import (
    CONTRADICTORY,
    accelerate,
    force_contacts,
    push,
    row_value,
)
from reference_solver.stepping.lasting import (
    CONTACTS,
    HOPS,
    OPEN,
    SLIP,
    STICK,
    TANGENTS,
    VELOCITIES,
    Lasting,
)
from reference_solver.stepping.noise import FORCE_NOISE, NOISE

#: Revisions of all modes before sweeps are asked for others to begin with.
REVISIONS = 16
#: Times that they are asked, each time for four times as many sweeps as the time before.
ATTEMPTS = 4
FIRST_SWEEPS = 16
#: Friction that reaches this share of its limit in sweeps slips.
AT_LIMIT = 1.0 - 1e-9


@inner_kernel
def measure(lasting: Lasting) -> None:
    """Size of the accelerations that meet in each contact, against which noise is measured."""
    for k in range(lasting.size[CONTACTS]):
        size = 0.0
        for row in range(1 + lasting.size[TANGENTS]):
            size = max(size, abs(lasting.gamma[k, row]))
        for side in range(2):
            for row in range(1 + lasting.size[TANGENTS]):
                part = 0.0
                for d in range(lasting.size[VELOCITIES]):
                    part += abs(lasting.jacobian[k, side, row, d] * lasting.free[lasting.body[k, side], d])
                size = max(size, part)
        lasting.scale[k] = size


@inner_kernel
def normal_gain(lasting: Lasting, k: int) -> float:
    """Rate of the normal velocity of contact k [m/s^2]."""
    return row_value(lasting, k, 0, lasting.acceleration) + lasting.gamma[k, 0]


@inner_kernel
def inverse_mass(lasting: Lasting, k: int, row: int) -> float:
    """Change of the speed of a row by a unit of its own force [1/kg]."""
    mass = 0.0
    for side in range(2):
        for d in range(lasting.size[VELOCITIES]):
            mass += lasting.jacobian[k, side, row, d] * lasting.response[k, side, row, d]
    return mass


@inner_kernel
def slip_coupling(lasting: Lasting, k: int) -> float:
    """Normal acceleration by a unit of load with the friction of the slip it brings along [1/kg]."""
    mass = inverse_mass(lasting, k, 0)
    for side in range(2):
        for t in range(lasting.size[TANGENTS]):
            share = lasting.friction[k] * lasting.direction[k, t]
            for d in range(lasting.size[VELOCITIES]):
                mass -= share * lasting.jacobian[k, side, 0, d] * lasting.response[k, side, 1 + t, d]
    return mass


@inner_kernel
def friction_size(lasting: Lasting, k: int) -> float:
    """Size of the friction of contact k [N]."""
    total = 0.0
    for t in range(lasting.size[TANGENTS]):
        total += lasting.force[k, 1 + t] ** 2
    return math.sqrt(total)


@inner_kernel
def begin_modes(lasting: Lasting) -> bool:
    """Modes to begin with: slips go on, all else sticks; False where no load can stand against a slip (E54)."""
    for k in range(lasting.size[CONTACTS]):
        speed = 0.0
        for t in range(lasting.size[TANGENTS]):
            speed += lasting.speed[k, 1 + t] ** 2
            lasting.direction[k, t] = 0.0
        speed = math.sqrt(speed)
        lasting.slides[k] = 1 if speed > NOISE * lasting.speeds[k] else 0
        lasting.parts[k] = HOPS if lasting.speed[k, 0] > NOISE * lasting.speeds[k] else 0
        lasting.mode[k] = STICK
        if lasting.friction[k] == 0.0 or lasting.slides[k] == 1:
            lasting.mode[k] = SLIP
        if lasting.slides[k] == 1:
            for t in range(lasting.size[TANGENTS]):
                lasting.direction[k, t] = lasting.speed[k, 1 + t] / speed
            if lasting.parts[k] == 0 and slip_coupling(lasting, k) <= 0.0:
                return False
        if lasting.parts[k] == HOPS:
            lasting.mode[k] = OPEN
        for row in range(1 + lasting.size[TANGENTS]):
            lasting.usual[k, row] = lasting.force[k, row] = 0.0
    return True


@inner_kernel
def set_slip(lasting: Lasting, k: int) -> None:
    """Let contact k slip against the friction it has."""
    size = friction_size(lasting, k)
    lasting.mode[k] = SLIP
    for t in range(lasting.size[TANGENTS]):
        lasting.direction[k, t] = -lasting.force[k, 1 + t] / size if size > 0.0 else 0.0


@inner_kernel
def revise(lasting: Lasting) -> int:
    """Give every contact whose forces or accelerations contradict its mode another one; how many there were."""
    changed = 0
    for k in range(lasting.size[CONTACTS]):
        slack = FORCE_NOISE * lasting.scale[k]
        noise = slack / inverse_mass(lasting, k, 0)
        if lasting.mode[k] == OPEN:
            if lasting.parts[k] == 0 and normal_gain(lasting, k) < -slack:
                changed += 1
                lasting.mode[k] = SLIP if lasting.slides[k] == 1 or lasting.friction[k] == 0.0 else STICK
        elif lasting.force[k, 0] < -noise:
            changed += 1
            lasting.mode[k] = OPEN
        elif lasting.mode[k] == STICK:
            if friction_size(lasting, k) > lasting.friction[k] * max(lasting.force[k, 0], 0.0) + noise:
                changed += 1
                set_slip(lasting, k)
        elif lasting.slides[k] == 0 and lasting.friction[k] > 0.0:
            changed += revise_slip(lasting, k, slack)
    return changed


@inner_kernel
def revise_slip(lasting: Lasting, k: int, slack: float) -> int:
    """A slip that begins goes the way of its acceleration; 1 if it does not."""
    along, size = 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        gain = row_value(lasting, k, 1 + t, lasting.acceleration) + lasting.gamma[k, 1 + t]
        along += gain * lasting.direction[k, t]
        size += gain**2
    size = math.sqrt(size)
    if along < -slack:
        lasting.mode[k] = STICK
        return 1
    if lasting.size[TANGENTS] == 1 or size - along <= slack:
        return 0
    for t in range(lasting.size[TANGENTS]):
        gain = row_value(lasting, k, 1 + t, lasting.acceleration) + lasting.gamma[k, 1 + t]
        lasting.direction[k, t] = gain / size
    return 1


@inner_kernel
def sweep_forces(lasting: Lasting, sweeps: int) -> None:
    """Projected Gauss-Seidel sweeps over forces; sets the modes they tell, and the usual forces."""
    accelerate(lasting)
    for _ in range(sweeps):
        for k in range(lasting.size[CONTACTS]):
            if lasting.parts[k] == 0:
                sweep_contact(lasting, k)
    for k in range(lasting.size[CONTACTS]):
        for row in range(1 + lasting.size[TANGENTS]):
            lasting.usual[k, row] = lasting.force[k, row]
        if lasting.force[k, 0] * inverse_mass(lasting, k, 0) <= FORCE_NOISE * lasting.scale[k]:
            lasting.mode[k] = OPEN
        elif lasting.slides[k] == 1 or lasting.friction[k] == 0.0:
            lasting.mode[k] = SLIP
        elif friction_size(lasting, k) >= AT_LIMIT * lasting.friction[k] * lasting.force[k, 0]:
            set_slip(lasting, k)
        else:
            lasting.mode[k] = STICK


@inner_kernel
def sweep_contact(lasting: Lasting, k: int) -> None:
    """Forces of contact k that suit the accelerations of its bodies."""
    gain = normal_gain(lasting, k)
    mass = slip_coupling(lasting, k) if lasting.slides[k] == 1 else inverse_mass(lasting, k, 0)
    before = lasting.force[k, 0]
    lasting.force[k, 0] = max(before - gain / mass, 0.0)
    push(lasting, lasting.acceleration, k, 0, lasting.force[k, 0] - before)
    if lasting.friction[k] == 0.0:
        return
    mass, size = 0.0, 0.0
    for t in range(lasting.size[TANGENTS]):
        mass = max(mass, inverse_mass(lasting, k, 1 + t))
    for t in range(lasting.size[TANGENTS]):
        gain = row_value(lasting, k, 1 + t, lasting.acceleration) + lasting.gamma[k, 1 + t]
        wanted = lasting.force[k, 1 + t] - gain / mass
        if lasting.slides[k] == 1:
            wanted = -lasting.friction[k] * lasting.force[k, 0] * lasting.direction[k, t]
        lasting.wanted[t] = wanted
        size += wanted**2
    size, limit = math.sqrt(size), lasting.friction[k] * lasting.force[k, 0]
    for t in range(lasting.size[TANGENTS]):
        wanted = lasting.wanted[t] * (limit / size if size > limit else 1.0)
        push(lasting, lasting.acceleration, k, 1 + t, wanted - lasting.force[k, 1 + t])
        lasting.force[k, 1 + t] = wanted


@inner_kernel
def decide(lasting: Lasting) -> bool:
    """Modes, forces and accelerations of the evaluated state; False if none are found.

    Modes are revised all at once until none contradicts itself, which ends where the state determines them; where
    revisions go round in circles, sweeps tell other modes to begin with.
    """
    measure(lasting)
    if not begin_modes(lasting):
        return False
    sweeps = FIRST_SWEEPS
    for _ in range(ATTEMPTS):
        for _ in range(REVISIONS):
            if force_contacts(lasting, False) == CONTRADICTORY:
                break
            if revise(lasting) == 0:
                keep_usual(lasting)
                return True
        for k in range(lasting.size[CONTACTS]):
            for row in range(1 + lasting.size[TANGENTS]):
                lasting.force[k, row] = lasting.usual[k, row]
        sweep_forces(lasting, sweeps)
        sweeps *= 4
    return False


@inner_kernel
def keep_usual(lasting: Lasting) -> None:
    """Keep the forces of an instant as those from which redundant ones are told."""
    for k in range(lasting.size[CONTACTS]):
        for row in range(1 + lasting.size[TANGENTS]):
            lasting.usual[k, row] = lasting.force[k, row]
