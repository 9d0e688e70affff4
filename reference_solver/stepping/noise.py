"""What is round-off and not physics, and what ends a run, for all of the step; each number with its reason."""

from __future__ import annotations

#: Events located in one step before the run ends: a ball at 100 m/s with .1 mm of play has 4e3 at 1/240 s. None is ever
#: left out.
EVENT_BUDGET = 100_000
#: A contact that still approaches with this share of its reference speed after its solve is not solved, whatever its
#: impulse: solves end at 1e-13, and stalled ones of mass ratio 1e6 near 1e-6.
UNSOLVED = 1e-3
#: And with more than this share of the largest reference speed of all contacts of its island: loads elsewhere pass
#: impulses through it, of which solves leave their round-off.
PASSED_ON = 1e-9

#: Gaps and overlaps below this fraction of the smaller half width are round-off, not geometry.
ROUND_OFF = 1e-12
#: The same for coordinates far from the origin: some ten units in their last place.
COORDINATE_NOISE = 2e-15
#: Normal and tangential velocities below this share of a contact's reference speed are round-off of the solve, whose
#: residual is 1e-13 of it: neither an approach, nor a parting, nor a slip.
NOISE = 1e-11
#: A gap that its own approach closes within this share of the time left is closed: a few units in the last place of
#: the time of impact.
LATE = 1e-15
#: The same at impulse level, as a share of a step: closing gaps moves bodies after an impact is located.
#: What that anticipates of an impact is a share of what such a step leaves of gaps.
NEARLY = 1e-3
#: A body that goes no farther than this share of its smaller half width in a step stands still: that is no more than a
#: few units in the last place of where it is.
STILL = 1e-15
#: What is left of a step below this share of it is nothing.
NOTHING_LEFT = 1e-14
#: Share of a contact's usual force below which a force is none; stage forces are known to 1e-13 of it, and events are
#: located to 1e-11.
FORCE_NOISE = 1e-9
#: An entry of a row that changes by less than this share of its body's reach along a path stays what it is: what that
#: leaves out of the motion is as much of h a.
FROZEN = 1e-13
#: Round-off floor of a contact's reference speed, as a share of the speeds of its two points: with a residual of
#: 1e-13 it allows 5e-15 of them, about 20 units in the last place.
SPEED_SHARE = 0.05
#: A sub-step shorter than this share of a step tells nothing about forces.
SHORT = 1e-3
#: A gap drifts if its rate is more than this share of the contact's reference speed. What drifts less, by round-off or
#: the least disturbance, leaves a gap that the next sub-step closes.
DRIFT = 1e-6
#: A gap below this fraction of the smaller half width is touching. Far above round-off, far below what a body
#: moves in a step.
TOUCHING = 1e-9
#: A gap below this fraction of the smaller half width counts as none at impulse level. Contacts that hold each other
#: have no room to close what round-off left between them: an answer that must do so differs by whole loads from one
#: that need not, and is found by nobody. A tenth of what is touching; `driver.settle` closes it.
NO_GAP = 1e-10
#: Velocities that differ from those the impulses give by more than this share of all that these can do are mended: some
#: fifty units in the last place, which is what summing the impulses of a body costs itself.
MENDED = 1e-14
#: What is watched while modes are held is at its end where it is this small a share of what it is measured against.
LOCATED = 1e-13
