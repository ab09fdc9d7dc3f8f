"""Sources of the peers that are written by hand, and the driver around them."""
