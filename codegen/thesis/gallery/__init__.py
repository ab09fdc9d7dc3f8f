"""Every figure of the thesis that can be computed, from a spec each, and what its text says of it, checked."""
