"""Fits of models to a log: free-run simulation of short segments, and the force balance along the motion."""
