"""Drafts of column maps."""
