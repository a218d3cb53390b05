"""Bad input to friction, each kind once: a ParameterError and nothing else is the answer to all of it."""
REFUSED = {}
