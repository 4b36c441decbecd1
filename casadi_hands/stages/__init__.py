"""The four optimisations: which variables, which terms, what start."""
