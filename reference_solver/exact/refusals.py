"""What the loop cannot tell: every reason, in one sentence each."""

from __future__ import annotations


class Refused(Exception):
    """The loop has no answer; the text says why.

    Parameters
    ----------
    facts
        What stands in the braces of `sentence`.
    """

    sentence = ""

    def __init__(self, **facts: object) -> None:
        super().__init__(self.sentence.format(**facts))


class NoSolution(Refused):
    """A contact problem has no solution; of impacts `NoImpulses` says so, of forces a jam (E54) or `NoForces`."""

    sentence = "a contact problem has no solution"


class NoImpulses(Refused):
    """Bodies that meet cannot part: friction wedges one, or one with a prescribed motion crushes it."""

    sentence = "no impulses part the bodies that meet at {t:.9g} s: one is wedged, or crushed by one that is moved"


class Unconverged(Refused):
    """Friction of several contacts in space is not found."""

    sentence = "friction of {count} contacts is not found, by Newton's method nor by sweeps"


class NoForces(Refused):
    """Neither forces nor impulses obey the laws."""

    sentence = "no forces exist at {t:.9g} s, and no impulses that would change that"


class Undecided(Refused):
    """An iteration shows which contacts hold, stick and slip, but the equations of these modes have no solution."""

    sentence = "it is not decided at {t:.9g} s which contacts hold, stick and slip"


class Unlawful(Refused):
    """What was solved for breaks a law by more than round-off."""

    sentence = "forces or impulses break the laws of contact at {t:.9g} s by {share:.0e} of their size"


class NoStep(Refused):
    """Steps of a motion that turns become ever shorter without reaching their tolerance."""

    sentence = "no step from {t:.9g} s on reaches its tolerance, however short"


class NoProgress(Refused):
    """Events follow each other in no time, or in hardly any."""

    sentence = "{count} events follow each other at {t:.9g} s and time hardly goes on; most often {most}"


class TooManyImpacts(Refused):
    """Impacts of one instant that do not end."""

    sentence = "more than {count} impacts follow each other at {t:.9g} s"


class TooManyPieces(Refused):
    """More events than a run may have."""

    sentence = "more than {count} pieces of motion up to {t:.9g} s"


class Overlap(Refused):
    """Bodies are in each other: a meeting was missed, or the world starts so."""

    sentence = "bodies {a} and {b} overlap by {depth:.1e} m at {t:.9g} s"


class EnergyGrows(Refused):
    """Contacts create energy."""

    sentence = "energy grows by {amount:.1e} J in a piece from {t:.9g} s"
