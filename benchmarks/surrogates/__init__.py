"""Logs whose residual has been cut from the motion: how often an effect is credited where none can be."""
