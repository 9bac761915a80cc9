"""Verbs about files and the catalogue."""
