"""Bowden-Tabor friction on sliding windows and its stochastic process."""
