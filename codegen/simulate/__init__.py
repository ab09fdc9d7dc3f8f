"""Machines with real stick and slip: recorded inputs replayed, logs predicted in free run, closed loops simulated."""

from codegen.simulate.closed_loop import simulate
from codegen.simulate.controller import Controller, Feedback, Sample, sampled
from codegen.simulate.free_run import free_run, free_run_rmse
from codegen.simulate.loop_run import LoopRun, write_log
from codegen.simulate.observed_loop import METHODS, run_loop
from codegen.simulate.observer_in_loop import Cancellation, ObserverInLoop, generated_observer
from codegen.simulate.plant import Plant, simulate_open_loop
from codegen.simulate.sensors import Sensors
from codegen.simulate.simulated import Simulated, write_simulated

__all__ = [
    "METHODS",
    "Cancellation",
    "Controller",
    "Feedback",
    "LoopRun",
    "ObserverInLoop",
    "Plant",
    "Sample",
    "Sensors",
    "Simulated",
    "free_run",
    "free_run_rmse",
    "generated_observer",
    "run_loop",
    "sampled",
    "simulate",
    "simulate_open_loop",
    "write_log",
    "write_simulated",
]
