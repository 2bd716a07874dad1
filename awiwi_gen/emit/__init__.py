"""From graph to C text to files."""
