"""Models simulated and fitted to a log: free runs of short segments, and the force balance along the motion."""
