"""Time of ``stiction diagnose``, from the command to its end."""
