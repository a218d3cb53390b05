"""Key files: what the results of a stage depend on."""
