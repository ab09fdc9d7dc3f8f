"""What was found of a machine, in the formats of others: simulators, firmware, controllers."""
