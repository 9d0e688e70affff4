"""DART through dartpy; what stands where is told in `adapters.engine_folder`.

profiles       one contact solver each: friction pyramids (Dantzig, PGS) and exact cones (NSGS, FBF) in one engine
translation    materials of pairs as one number per body
simulation     one world
engine         the adapter
"""

from adapters.dart.engine import DartEngine

__all__ = ["DartEngine"]
