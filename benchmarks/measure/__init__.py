"""How a peer is built, checked against ours, counted and timed; nothing here depends on what is measured."""
