"""The same cells on other releases of an engine, each in its own environment.

choosing.py       A..B | LIST | latest  ->  [Release]: versions in the registry and their distributions
environments.py   Release -> Environment: built once under a cache folder, with a receipt; incomplete ones do not count
carried.py        our own code (and an engine's plugin), laid out as an installation without dependencies
driven.py         runs in the environment: plain data in, observations out; needs numpy and the engine
driving.py        the other end of it: one run per release in the same store; stored cells are not run again
timing.py         cost of a scene on a release, relative to a loop of Python on the same machine
history.py        rows over releases: what changed, in which release
floors.py         noise floors of changed cells, from starts moved by the last place
bisection.py      the release in which a verdict or a value changes, in log2(n) runs
"""
