"""Observers that `stiction generate` wrote: each subpackage is one, importable as generated.NAME."""
