"""Speed against error: what an answer of a given error costs on each engine.

    canonical.py   a scene's ONE declared error, the state in which it is timed, and its steps (in `validation`)
    sweep.py       which cells: every scene x engine x profile over steps and iterations
       |  accuracy first, in worker processes: observations of a run in the store
       v
    units.py       what is timed: the work points, an empty scene and a free body, piles of 1 to 1000 boxes
    lane.py        the timing lane: one process, one thread, engines interleaved, rounds until it is certain
       |  raw timings of the same run in the store
       v
    statistics.py  median, bootstrap interval, drift, lower envelope, exponent
    reading.py     tables of a bench run: work points, time at equal error, scaling, overhead, ratios

Beside it, with the same lane:

    targets.py     the textbook step against other engines at 10 sweeps and at equal error (targets.toml, errors.py)
    scenes.py      scenes that only a bench has
    piles.py       what it costs to cut steps at events, in piles
    guard.py       whether the textbook step became slower than it was (guard.toml)

Protocol
    * Accuracy is measured before anything is timed, and a cell whose physics is invalid is never timed.
    * Timed is one call ``simulation.advance(n)`` of a simulation that was built, and brought into the state that
      matters, outside the clock. Truths and closed forms are never timed.
    * Each round times every open unit once, engines in a new random order (seed kept); a unit closes when the
      bootstrap interval of its median is narrower than 5 %, or after 40 rounds.
    * The clock is the CPU time of the process (what else runs on the machine is not charged); wall time stands
      beside it.
    * Every raw timing carries the error it bought and a hash of the state it ended in.
"""
