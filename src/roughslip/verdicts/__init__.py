"""What the paper states, the rules that judge it, and how far a verdict depends on assumptions."""
