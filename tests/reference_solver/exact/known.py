"""Compare the event loop with the motions whose truth is known (E76).

    python tests/reference_solver/exact/known.py [--only TEXT] [--limit SECONDS]

prints one line for each motion that the loop does not hold, and the counts. A motion is *held* if it ends as near to
its truth as the loop's own bound says: twice what a coarser tolerance changes, and what the truth may be off.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np
from compare import COARSER, Late, limited, poses
from oracle import World

from reference_solver.certificate.truth import distance
from reference_solver.exact import Refused
from reference_solver.settings import TOLERANCE
from tests.verification.known.gates import MOTIONS, SEEDS
from tests.verification.known.motion import TRUTH, Motion, off


def held(motion: Motion) -> tuple[str, str]:
    """Return what became of a motion, a word, and why."""
    world = World(motion.model, motion.time, 1, 1)
    found, why = poses(world)
    if why:
        return "refused", why
    coarser, why = poses(world, COARSER * TOLERANCE)
    if why:
        return "refused", f"at a coarser tolerance: {why}"
    miss = off(motion, found[-1])
    bound = TRUTH + 2.0 * float(distance(motion.model, found[-1:], coarser[-1:])[0])
    return ("held" if miss <= bound else "off"), f"{miss:.1e} of {bound:.1e} m"


def main() -> None:
    """Print what became of every motion."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="motions whose name has it")
    parser.add_argument("--limit", type=float, default=20.0, help="CPU of a motion")
    asked = parser.parse_args()
    counts: Counter[str] = Counter()
    for name, draw in MOTIONS.items():
        if asked.only not in name:
            continue
        for seed in range(SEEDS):
            motion = draw(np.random.default_rng(seed))
            begin = time.process_time()
            try:
                with limited(asked.limit):
                    word, said = held(motion)
            except Late:
                word, said = "late", f"after {asked.limit:g} s"
            except Refused as refused:
                word, said = "refused", str(refused)
            except Exception as error:  # what is no refusal is a fault of the loop
                word, said = "fault", f"{type(error).__name__}: {error}"
            counts[word] += 1
            if word != "held":
                print(f"{name} {seed}: {word} {said} ({time.process_time() - begin:.1f} s)", flush=True)
    print(dict(counts))


if __name__ == "__main__":
    main()
