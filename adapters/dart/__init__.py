"""DART through dartpy; what stands where is told in `adapters.engine_folder`.

profiles       one contact solver each: friction pyramids (Dantzig, PGS) and exact cones (NSGS, FBF) in one engine
translation    materials of pairs as one number per body
simulation     one world
engine         the adapter
laws           what it does by design; blows of balls on a floor (`falling`), in a line (`in_line`) and in a plane
               (`balls`) step by step, of boxes on an edge (`landing`) that slides (`rubbing`), of balls that slip
               (`slipping`), and what slips on a floor under a pyramid (`pyramid`)
"""

from adapters.dart.engine import DartEngine

__all__ = ["DartEngine"]
