"""The certificate checker: one file that needs nothing but Python, and can be copied away and read on its own."""
