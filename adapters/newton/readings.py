"""Newton's ways to read contact forces with XPBD; see `adapters.readings`."""

from __future__ import annotations

from adapters.newton.simulation import NewtonSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on


def _contact_f(simulation: NewtonSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        held, found = simulation.touching, list[Told]()
        if simulation.graph is None:
            return []
        count = int(held.rigid_contact_count.numpy()[0])
        force = simulation.told.contact_f.numpy()[:count, :3].astype(float)
        for k in range(count):
            first, second = (int(each.numpy()[k]) for each in (held.rigid_contact_shape0, held.rigid_contact_shape1))
            found.append((second, first, simulation.dt * force[k], None))
        return acting_on(body, found)

    return ask


_AVERAGED = Cause(
    ("rest",),
    "corrections of a body with several neighbours are averaged over its contacts (rigid_contact_con_weighting), and "
    "the forces are not what moved it; off by less than 1 % without",
)
_REBOUND = Cause(("blow",), "the rebound is a velocity of its own, in no force", {"rebounds": False})
READINGS = (
    Reading(
        'observables contact_f: solver.observables({"contact_f"}, contacts=contacts)', "force",
        "each contact; add up those of a body", "on the body of rigid_contact_shape0", "world axes",
        "the step just made", "with it: the correction of positions is the force", _contact_f,
        causes=(_AVERAGED, _REBOUND),
    ),
)  # fmt: skip
