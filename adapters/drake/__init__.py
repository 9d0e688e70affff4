"""Drake through pydrake; `adapters.engine_folder` describes the modules.

shipped        default values
profiles       one approximation of contact each: Lagged, SAP, TAMSI, Similar
translation    friction of pairs from one value per body
simulation     one world
engine         the adapter
"""

from adapters.drake.engine import DrakeEngine

__all__ = ["DrakeEngine"]
