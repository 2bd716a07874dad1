"""Gains of all joints: that hold on a family of plants, or from a file of costs; and the check of a hand's own gains."""
