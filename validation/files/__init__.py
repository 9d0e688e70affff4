"""Scenes that people write: text -> fields -> a canonical scene, and what of it is judged; models as well."""
