"""What an instant brings, and how rebounds go on (E21, E22)."""

from __future__ import annotations

from reference_solver.compilation import kernel

#: What becomes of a contact in an impact: it rebounds; its series of bounces ends within the sub-step (E22); it ends a
#: chain of impacts without end (E22), and does not rebound either; it parts already, and has no part in the impact.
OPEN_ENDED, SERIES_ENDS, CHAIN_ENDS, PARTS = 0, 1, 2, 3
#: What an instant brings: nothing, contacts whose normals turned (spatial), impacts no faster than what loads do in a
#: step with e = 0, such with e > 0, faster ones.
NO_IMPACT, TURNED, LANDED, REBOUNDED, STRUCK = 0, 1, 2, 3, 4
#: A series of rebounds is held from where friction, which acts at its impacts only, moves bodies by no more than this
#: share of the smaller half width other than it would in a contact; as long as half of a step's patience is left.
SERIES_DRIFT = 1e-11
#: Steps for which what a series that ends is off in its velocities counts as way: so many that it does until bodies
#: have turned, but for the shortest steps. Counted over a few, a finer run would end its series sooner, and be worse.
DRIFT_STEPS = 1e4
#: An impact is soft that closes no more than this share of the smaller half width in a step. Without loads all others
#: are hard, and of bodies caught between others they have no end, each slower than the one before.
CREEP = 1e-6
#: A rebound is seen to be back once it has fallen through the noise of its gap, and is lifted out of it again (E24):
#: none of a series gets lower than e^2/(1 - e^2) times that, and from twice its speed there on none is followed.
LOWEST = 4.0
#: Passes that mark ending series of rebounds; each marks at least one row more.
SERIES_PASSES = 4


@kernel
def turns_aside(leaves: float, lasts: float, rate: float, dt: float) -> float:
    """How far bodies go elsewhere for rows that turn at ``rate`` while a series of rebounds that is held ends [m].

    Held contacts push from the start, those that rebound at their impacts: the impulse is the same, its mean instant
    is not, by up to ``lasts``, in which levers and normals turn by ``rate * lasts``. What velocities miss,
    ``leaves * rate * lasts``, counts over `DRIFT_STEPS` steps, or until bodies have turned.
    """
    return leaves * lasts * min(DRIFT_STEPS * dt * rate, 1.0)


@kernel
def is_lowest(leaves: float, pull: float, noise: float, e: float) -> bool:
    """Whether rebounds hardly get lower: the noise [m] of their gap gives back what each of them loses."""
    return leaves * leaves * (1.0 - e * e) <= LOWEST * 2.0 * pull * noise * e * e


@kernel
def drifts_aside(slip: float, gain: float, friction: float, pull: float, returns: float, e: float) -> float:
    """How far friction at impacts only moves bodies along their contact, beside what it does in a contact [m].

    Flights of the times T e^k under the accelerations a, which friction takes from what slips or would: a T^2 / 2 of
    each, T^2 / (1 - e^2) of all. So it is where an impact ends a ``slip`` that one with e = 0 does not end. The
    ``friction`` is mu times how much more the contact yields along than across.
    """
    if friction == 0.0:
        return 0.0
    acceleration = max(abs(gain), friction * pull if slip != 0.0 else 0.0)
    return acceleration * returns * returns / (2.0 * (1.0 - e * e))
