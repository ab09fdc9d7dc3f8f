"""Discriminating experiments for effects that one log does not distinguish."""
