"""Replay of the generated observer over a measured log: compiled C, or the Python twin."""
