"""The thesis: the audit of its printed formulas and its figures. Only `app/` imports it."""
