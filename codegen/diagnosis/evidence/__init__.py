"""Evidence for an effect: comparison of fits with and without it by free runs and force residuals, and intervals."""
