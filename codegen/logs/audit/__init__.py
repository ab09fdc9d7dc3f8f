"""Preflight of a log: the record and the motion, and signs, scales and columns by the balance of forces."""
