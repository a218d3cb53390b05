"""Bowden-Tabor friction on windows that slide along a strip, its statistics, and its stochastic process.

Windows: bowden_tabor, statistics, correlation, marginal, penetration. Process: process, and paths of it by
`paths.prepare`. The package imports nothing by itself, so that a stage depends only on the modules that it names.
"""
