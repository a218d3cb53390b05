"""What the rules ask of the scenes."""
