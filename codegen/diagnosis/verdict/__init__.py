"""The verdict from the outcome of forward selection: held-out checks, adopted values, experiments, augmented spec."""
