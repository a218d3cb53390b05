"""The report page of a scene and of the study."""
