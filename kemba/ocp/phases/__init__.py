"""The multi-phase program: fixed modes, free phase durations, Radau inside."""
