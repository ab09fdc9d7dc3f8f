"""What every station uses and what knows nothing of friction: errors, files, text, resources, compiler, terminal."""
