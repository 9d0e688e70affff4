"""The event loop against the motions whose truth is known (E76)."""

import numpy as np
import pytest
from known import held

from tests.verification.known.gates import MOTIONS, SEEDS

#: Of all motions one whose contacts begin and end where edges cross.
LOOKED_AT = "box over the corner of a table"
ALL = [pytest.param(name, marks=() if name == LOOKED_AT else pytest.mark.long) for name in MOTIONS]


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("seed", range(SEEDS))
def test_known_motions_within_their_bound(name, seed):
    word, said = held(MOTIONS[name](np.random.default_rng(seed)))
    assert word == "held" or (word == "refused" and name != LOOKED_AT), said
