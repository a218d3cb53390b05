"""Normal contact of a rough elastic half-space with a rigid plane."""
