"""DART through dartpy; `adapters.engine_folder` describes the modules.

profiles       one contact solver each: friction pyramids (Dantzig, PGS) and exact cones (NSGS, FBF) in one engine
translation    materials of pairs from one value per body
simulation     one world
engine         the adapter
laws           designed deviations, step by step: bodies that collide without slip (`meeting`), boxes that land on
               several corners (`landing`) or on a sliding edge (`rubbing`), balls that land slipping (`slipping`), and
               slip over a floor with a friction pyramid (`pyramid`)
"""

from adapters.dart.engine import DartEngine

__all__ = ["DartEngine"]
