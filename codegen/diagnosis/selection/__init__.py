"""Forward selection of effects in rounds: candidates are fitted, ranked, and tested again with the other effects."""
