"""Objects of the science, made from the part of a scene that a stage reads."""
