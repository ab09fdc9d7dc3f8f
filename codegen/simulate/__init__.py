"""Machines with real stick and slip: recorded inputs replayed, logs predicted in free run, closed loops simulated."""
