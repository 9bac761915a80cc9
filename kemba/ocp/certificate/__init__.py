"""What a written plan really satisfies, and the status that follows."""
