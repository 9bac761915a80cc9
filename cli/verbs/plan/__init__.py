"""Verbs that plan and execute."""
