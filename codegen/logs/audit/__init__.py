"""Preflight of a log: signs, scales, units and the order of columns, by the balance of forces along the motion."""
