"""What verbs write: run folders filled with results, pages, and other formats."""
