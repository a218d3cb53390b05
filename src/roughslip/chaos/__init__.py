"""Polynomial chaos of the random contact pressure."""
