"""The certificate checker: a folder that needs nothing but Python, and can be copied away and read on its own."""
