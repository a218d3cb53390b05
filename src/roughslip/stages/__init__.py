"""One small command a stage: read, call the package, write."""
