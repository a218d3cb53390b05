"""Measured surfaces: instrument files, statistics with intervals, fitted models."""
