"""Rough surfaces: covariance, Karhunen-Loeve expansion, exact sampling of stationary strips."""
