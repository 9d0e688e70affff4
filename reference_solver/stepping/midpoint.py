"""How far the impulse-level scheme closes the gaps that it leaves, in both dimensions (E28)."""

from __future__ import annotations

#: Gaps above this share of what touches are closed: what is left is well inside.
GAP_SHARE = 0.25
#: Impulses of a solve for displacements start from this multiple of what its widest gap alone would take.
FAR_ABOVE = 1e3
#: Largest gap, as a share of the smaller body's reach, that is closed at a time: (w h)^3 of a turn of .1 rad, as bodies
#: that fall over have it in steps of 1/60 s, is 1e-3.
LEFT_OVER = 1e-3
#: Residual of the solve that closes gaps, and the sweeps it may take: impulses count from a thousand times what the
#: widest gap takes, so that it leaves some 1e-6 of that, and what is left is measured anew after the next sub-step.
CLOSED, CLOSING_SWEEPS = 1e-8, 400
#: Overlap, as a share of the smaller half width, that closing gaps may leave by pushing a body into one that it did not
#: touch; and how often gaps are closed to undo that.
PUSHED_INTO, CLOSINGS = 1e-5, 4
#: Farthest that closing gaps may move a body, in multiples of the widest: a lever of a slender body.
LEVERAGE = 100.0
