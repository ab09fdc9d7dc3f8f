"""Stiction: friction observers from a specification.

The stations of the line, each one function with one typed value in and one out::

    read_spec -> build_system -> build_observer -> analyse -> certify -> build_program -> emit_sources
    read_log -> diagnose_log -> augmented_text, and round again

See docs/architecture.md; ``stiction.py`` beside this folder is the public API.
"""
