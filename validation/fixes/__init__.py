"""Fixes: searched on a scene, tried on a panel of other cases, and kept in a table."""
