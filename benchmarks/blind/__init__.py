"""Blind tests of discovery: logs from a simulator that shares no code with the fit."""
