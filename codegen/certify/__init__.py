"""Certificates, bounds in newtons and what to change after a refusal: searched here, accepted by `checker/` alone."""
