"""The model that is written: its effects at their joint estimate, its error, its file."""
