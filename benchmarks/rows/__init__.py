"""The rows of the page, one file each: a function ``row()`` that gives a Row."""
