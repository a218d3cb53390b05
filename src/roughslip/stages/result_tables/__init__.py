"""Variables that stages write."""
