"""Bullet through PyBullet; `adapters.engine_folder` describes the modules.

shipped         Bullet's own constants, and the reviewed releases
profiles        settings and their reasons
simulation      one world in a DIRECT client
clipped         bodies with faces for clipping
engine          the adapter
contact_law     one ball over a face, as a scalar recurrence of the settings
"""

from adapters.bullet.engine import BulletEngine

__all__ = ["BulletEngine"]
