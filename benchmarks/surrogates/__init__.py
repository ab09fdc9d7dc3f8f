"""Logs whose residual has been cut from the motion: how often an effect is accepted where none can be."""
