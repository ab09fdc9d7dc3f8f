"""From the outcome of forward selection to the answer: held-out checks, adopted values, words, augmented spec."""
