"""Bullet through PyBullet; what stands where is told in `adapters.engine_folder`.

shipped         numbers of Bullet itself, and the releases that were looked at
profiles        settings with their reasons
simulation      one world in a DIRECT client
clipped         bodies whose faces Bullet knows
engine          the adapter
contact_law     one ball over a face, as a scalar recurrence of the settings
"""

from adapters.bullet.engine import BulletEngine

__all__ = ["BulletEngine"]
