"""Rivals on the same logs: parameters alone by mujoco.sysid, a sparse sum by PySINDy; held-out errors by one ruler."""
