"""Drake through pydrake; what stands where is told in `adapters.engine_folder`.

shipped        its own numbers
profiles       one approximation of contact each: Lagged, SAP, TAMSI, Similar
translation    friction of pairs as one number per body
simulation     one world
engine         the adapter
"""

from adapters.drake.engine import DrakeEngine

__all__ = ["DrakeEngine"]
