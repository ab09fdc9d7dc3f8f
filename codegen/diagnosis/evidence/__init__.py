"""Whether a fit with an effect explains more than one without, by free runs and by force residuals, and its errors."""
