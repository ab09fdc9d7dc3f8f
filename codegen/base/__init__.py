"""General services, independent of friction: errors, files, text, resources, compiler, terminal."""
