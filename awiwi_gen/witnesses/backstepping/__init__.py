"""The backstepping laws of chapters 15 and 16."""
