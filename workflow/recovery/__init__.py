"""Recover from an interrupted or damaged run."""
