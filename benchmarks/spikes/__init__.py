"""Known effects put into real logs: how often, and from which size on, the diagnosis names them."""
