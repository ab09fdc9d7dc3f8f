"""The printed formulas of the thesis against our own derivation: what holds, what does not."""
