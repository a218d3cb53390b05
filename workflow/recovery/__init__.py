"""Recovery after an interrupted or damaged run."""
