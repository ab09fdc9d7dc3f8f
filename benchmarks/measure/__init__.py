"""How a peer is built, held to ours, counted and timed; nothing here knows what is measured."""
