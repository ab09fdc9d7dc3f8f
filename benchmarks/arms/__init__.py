"""The diagnosis on simulated robot arms whose truth is known."""
