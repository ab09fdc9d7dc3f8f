"""Replay of the generated observer over a measured log: as compiled C."""
