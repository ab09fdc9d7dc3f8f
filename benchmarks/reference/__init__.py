"""The pages of docs/ that are made of the registries: laws, effects and codes of errors."""
