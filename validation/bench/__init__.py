"""Speed against error: the cost of an answer of a given error on each engine.

    canonical.py   the ONE headline error of a scene, the state in which it is timed, its steps (in `validation`)
    sweep.py       the cases: every scene x engine x profile over steps and iteration counts
       |  errors first, in worker processes: observations of a run in the store
       v
    units.py       what is timed: the work points, an empty scene and a free body, piles of 1 to 1000 boxes
    lane.py        the timing process: one thread, engines interleaved, rounds until the intervals are narrow
       |  raw timings of the same run in the store
       v
    statistics.py  median, bootstrap interval, drift, lower envelope, exponent
    reading.py     tables of a bench run: work points, time at equal error, scaling, overhead, ratios

Other benchmarks, timed in the same way:

    targets.py     the textbook step against other engines at 10 sweeps and at equal error (targets.toml, errors.py)
    scenes.py      scenes that only a bench has
    guard.py       whether the textbook step has become slower (guard.toml)

Protocol
    * Errors are measured before anything is timed. A case with invalid physics is never timed.
    * One call ``simulation.advance(n)`` is timed. The simulation is built, and brought into the state of interest,
      before the clock starts. Truths and closed forms are never timed.
    * Each round times every open unit once, engines in a new random order (its seed is stored). A unit closes when the
      bootstrap interval of its median is narrower than 5 %, or after 40 rounds.
    * The clock is the CPU time of the process, which other processes of the machine do not change; wall time is stored
      beside it.
    * Every raw timing contains the error of the timed case and a hash of its end state.
"""
