"""Audit of the thesis: its printed formulas compared with our own derivations."""
