"""A verb, a file."""
