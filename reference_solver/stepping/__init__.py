"""What the steps of both dimensions share: paths, and the first contact of two bodies that follow them.

A *path* (``paths.py``) is a polynomial of a body's displacement; impacts are found on it (``time_of_impact.py``).
This package knows no shapes and no rotations. What it needs of a dimension it asks by name (``operations.py``): a
kernel of the same name is provided by ``planar/`` and ``spatial/``, and chosen by the type of the first argument. It
imports neither of the two.
"""
