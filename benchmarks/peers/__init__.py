"""Who else computes the step: sources by hand, and what other tools generate from the same equations."""
