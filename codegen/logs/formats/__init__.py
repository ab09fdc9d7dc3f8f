"""A file a log format: names of columns, then the numbers of those that are wanted; ``source.py`` is their base."""
