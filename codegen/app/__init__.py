"""The verbs of the command line: a file a verb, with its function, its typed result and what is printed of it."""
