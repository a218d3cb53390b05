"""What surrounds the science: rules, what they ask for, measurements. Imported as `from workflow.x import y` alone."""
