"""The contact problem of one step solved as a whole: a semismooth Newton method on the velocities of all bodies.

Both dimensions load their contacts into one form (`problem.py`); its matrix lives on the graph of touching bodies
(`ordering.py`, `envelope.py`); `newton.py` iterates. Equations E40 to E44 of ``docs/solver/direct.md``.
"""
