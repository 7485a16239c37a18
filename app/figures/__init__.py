"""Pictures, one idea a file."""
