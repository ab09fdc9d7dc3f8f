"""Export of a machine and its friction to simulators, motor firmware and controllers."""
