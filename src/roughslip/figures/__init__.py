"""Figures and their common style. DRAWN names the variables of a result that a figure draws and stores with it."""
