"""Random machines under a drive's control loop, with known effects: a simulator without any equation of codegen."""
