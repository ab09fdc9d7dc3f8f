"""The generated observer over a measured log: compiled C over blocks of samples, or the Python twin."""

from codegen.replay.engine import Engine, compiled_engine, engine_for, twin_engine
from codegen.replay.over_log import Replayed, replay_log
from codegen.replay.twin import load_twin

__all__ = ["Engine", "Replayed", "compiled_engine", "engine_for", "load_twin", "replay_log", "twin_engine"]
