"""Machines with real stick and slip: recorded inputs replayed, logs predicted in free run, closed loops simulated."""

from codegen.simulate.closed_loop import simulate
from codegen.simulate.free_run import free_run, free_run_rmse
from codegen.simulate.plant import Plant, simulate_open_loop
from codegen.simulate.simulated_log import SimulatedLog, write_log

__all__ = ["Plant", "SimulatedLog", "free_run", "free_run_rmse", "simulate", "simulate_open_loop", "write_log"]
