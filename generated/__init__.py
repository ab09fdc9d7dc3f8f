"""What `stiction generate` makes of the shipped specs; each subpackage is an observer, importable as generated.NAME."""
