"""Log formats, one file each: classes that name the columns and load some of them; ``source.py`` has their base."""
