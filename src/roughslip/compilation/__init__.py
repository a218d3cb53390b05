"""Compiled functions, cached by the code that they compile, and the hash of source code that names the cache."""
