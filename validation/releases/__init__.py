"""Since when? The same cells on other releases of an engine, each in an environment of its own.

choosing.py       A..B | LIST | latest  ->  [Release]: what the registry offers, which distribution carries it
environments.py   Release -> Environment: built once under a cache folder, with a receipt; nothing half-built counts
carried.py        our own code (and an engine's plugin), laid out as an installation without dependencies
driven.py         runs in the environment: plain data in, observations out; needs numpy and the engine
driving.py        the other end of it: one run per release in the same store, what is stored is asked once
timing.py         what a scene costs on a release, against a loop of Python on the same machine
history.py        rows over releases: what moved, in which release
floors.py         cells that moved, from starts moved by the last place: what any change would have moved is no step
bisection.py      the release in which a verdict flips or a value moves, in log2(n) questions
"""
